//! Beams: sunlight that mirrors reflect onto diffuse facets.
//!
//! Each side of a mirror facet that faces the sun sends a share of its sunlight along mirror chains; what arrives at a
//! diffuse facet is irradiance of the element it meets. Rows have the coupling's layout: row = facet * sides + side of
//! the mirror, target = unknown, weight = irradiance per unit of the sun's normal irradiance. Energy is conserved: the
//! weights times the targets' areas add up to the flux that leaves. A record also tells where the sun seems to stand
//! ([`crate::radiosity::sun_image`]), so that images need not take these means. Error of an element that receives n of
//! the rays: about n^-3/4 of its value.
//!
//! Constants of this file are measured by `cargo test --test thrown_sun` (errors of reflected sunlight) and `cargo bench
//! --bench counts` (instructions).

use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};
use crate::base::math::{Vec3, clamp, reflect};
use crate::base::qmc::{Sequence, hash2, triangle};
use crate::coupling::element::Elements;
use crate::coupling::mirror_path::STRAIGHT;
use crate::coupling::row_builder::RowBuilder;
use crate::coupling::rows::lobe_point;
use crate::coupling::{Coupling, Record, Row, TRACED};
use crate::radiosity::direct::TableShape;
use crate::radiosity::sun_image::{SunImagesMut, pack};
use crate::rays::bvh::{Bvh, HalfSpace};
use crate::rays::ray::Ray;
use crate::rays::surface::{Surface, opens_to_sky};
use crate::rays::swept::swept;
use crate::scene::sun::Sun;
use crate::scene::{NO_MIRROR, Scene};
use core::ops::Range;

/// Settings of beams, by the tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeamSettings {
    /// Rays per unit of mirror area (scene coordinates) seen from the sun.
    pub density: f64,
    /// Chains end where the product of their mirrors falls below this.
    pub cutoff: f64,
    /// Chains meet at most this many mirrors.
    pub mirrors: u32,
}

/// Fewest rays from one facet toward the sun: small mirrors reflect some.
const FACET_BEAM_RAYS_FEWEST: f64 = 16.0;

/// Most rays from one facet toward the sun: its sequence has 2^16 points.
const FACET_BEAM_RAYS_MOST: f64 = 65536.0;

impl BeamSettings {
    /// About `rays` rays in all, spread over the mirrors that face the sun by the area that it sees.
    pub fn new(scene: &Scene<'_>, sun: &Sun<'_>, rays: f64, cutoff: f64, mirrors: u32) -> BeamSettings {
        let mut area = 0.0;
        for facet in 0..scene.facets() {
            for side in 0..scene.sides() {
                area += seen_area(scene, sun, facet, side);
            }
        }
        BeamSettings { density: if area > 0.0 { rays / area } else { 0.0 }, cutoff, mirrors }
    }
}

/// Records of a row at which those of one element are added up for the first time.
const RECORDS_UNMERGED: usize = 1024;

/// About the records that one row needs while it grows: two for each ray, or twice as many as there are different ones.
pub fn unmerged(scene: &Scene<'_>, elements: &Elements<'_>, settings: &BeamSettings) -> usize {
    let largest = scene.areas().iter().fold(0.0, |a: f64, &b| a.max(b));
    let rays = (clamp(largest * settings.density, FACET_BEAM_RAYS_FEWEST, FACET_BEAM_RAYS_MOST) as usize)
        .next_power_of_two();
    (2 * rays).min(RECORDS_UNMERGED + elements.unknowns().saturating_mul(8))
}

/// Area of a mirror facet's side as the sun sees it; 0 where it mirrors nothing.
fn seen_area(scene: &Scene<'_>, sun: &Sun<'_>, facet: usize, side: usize) -> f64 {
    if scene.mirror(scene.material(facet)) == NO_MIRROR {
        return 0.0;
    }
    scene.areas().at(facet) * sun.cosine(scene.side_normal(facet, side))
}

/// Traces the beams of the mirror sides in `range` (facet * sides + side) into a block of `memory`, as
/// [`crate::coupling::rows::fill`] does; returns the number of rows done.
pub fn fill(
    scene: &Scene<'_>,
    bvh: &Bvh<'_>,
    elements: &Elements<'_>,
    sun: &Sun<'_>,
    settings: &BeamSettings,
    range: Range<usize>,
    memory: &mut [u8],
) -> Result<usize, Error> {
    let given = memory.len();
    let builder = RowBuilder::new(&range, scene.bands(), false, memory)?;
    let wanted = range.len();
    let mut tracer = Tracer { scene, bvh, elements, sun, settings, builder };
    for row in range {
        if tracer.row(row).is_none() {
            tracer.builder.drop_row();
            break;
        }
    }
    match tracer.builder.end() {
        0 if wanted > 0 => Err(Error::BufferTooSmall { needed: given.saturating_mul(2), given }),
        done => Ok(done),
    }
}

struct Tracer<'a, 'm> {
    scene: &'a Scene<'a>,
    bvh: &'a Bvh<'a>,
    elements: &'a Elements<'a>,
    sun: &'a Sun<'a>,
    settings: &'a BeamSettings,
    builder: RowBuilder<'m>,
}

impl Tracer<'_, '_> {
    fn row(&mut self, row: usize) -> Option<()> {
        let (facet, side) = (row / self.scene.sides().max(1), row % self.scene.sides().max(1));
        let area = seen_area(self.scene, self.sun, facet, side);
        if area <= 0.0 {
            self.builder.end_row(Row::default(), Some, Record::join_beam);
            return Some(());
        }
        let ahead = self.ahead(facet, side);
        if ahead[1].is_nothing() {
            self.builder.end_row(Row { state: TRACED, ..Row::default() }, Some, Record::join_beam);
            return Some(());
        }
        let wanted = clamp(area * self.settings.density, FACET_BEAM_RAYS_FEWEST, FACET_BEAM_RAYS_MOST);
        let rays = (wanted as u32).next_power_of_two();
        let sequence = Sequence::new(hash2(row as u32, 0xbea3_0000));
        let mut stats = Row { state: TRACED, rays, ..Row::default() };
        let mut fold = RECORDS_UNMERGED;
        for first in (0..rays).step_by(BEAM_RAYS_UNMERGED) {
            let end = rays.min(first + BEAM_RAYS_UNMERGED as u32);
            for start in (first..end).step_by(BEAM_RAYS_TOGETHER) {
                let numbers = start..end.min(start + BEAM_RAYS_TOGETHER as u32);
                self.rays((facet, side, &ahead), &sequence, numbers, &mut stats)?;
            }
            if self.builder.present() >= fold {
                fold = RECORDS_UNMERGED.max(2 * self.builder.merge_duplicates(Record::join_beam));
            }
        }
        let share = 1.0 / f64::from(rays);
        let finish = |record: Record| Some(record.scaled_beam(share));
        self.builder.end_row(stats, finish, Record::join_beam);
        Some(())
    }

    /// Facets that may stand in the way of the sun's light toward a mirror's side and, where it is flat and ideal, of the light that
    /// it throws: the same hits by fewer looks.
    fn ahead(&self, facet: usize, side: usize) -> [Ahead; 2] {
        let (scene, bvh) = (self.scene, self.bvh);
        let (Some(corners), true) = (scene.corners().get(facet), bvh.is_own()) else {
            return [Ahead::UNKNOWN; 2];
        };
        let surface = Surface::new(scene, facet, side, 1.0 / 3.0, 1.0 / 3.0);
        if opens_to_sky(scene, bvh, facet, surface.normal) {
            return [Ahead::NOTHING; 2];
        }
        let along = |direction: Vec3| match swept(corners, surface.normal, direction, self.sun.half_angle()) {
            Some(halves) => Ahead::within(bvh, &halves, facet as u32),
            None => Ahead::UNKNOWN,
        };
        let toward = self.sun.direction();
        let turns = !scene.is_smooth() && surface.flat_mirror(scene).is_some();
        [along(toward), if turns { along(surface.mirrored(scene, -toward)) } else { Ahead::UNKNOWN }]
    }

    /// The rays of these numbers, at most [`BEAM_RAYS_TOGETHER`], from mirror to mirror together.
    fn rays(
        &mut self,
        (facet, side, [sunward, mirrored]): (usize, usize, &[Ahead; 2]),
        sequence: &Sequence,
        numbers: Range<u32>,
        stats: &mut Row,
    ) -> Option<()> {
        let (scene, bvh) = (self.scene, self.bvh);
        let mut rays = [Ray::new(Vec3::ZERO, Vec3::Z); BEAM_RAYS_TOGETHER];
        let mut chains: [Option<Chain>; BEAM_RAYS_TOGETHER] = [None; BEAM_RAYS_TOGETHER];
        let mut count = self.start_chains((facet, side), sequence, numbers, (&mut rays, &mut chains));
        let mut hidden = [false; BEAM_RAYS_TOGETHER];
        match sunward.facets() {
            Some([]) => {}
            Some(facets) => {
                let all = rays.head(count).iter().zip(hidden.head_mut(count));
                all.for_each(|(ray, hidden)| *hidden = bvh.closest_among(ray, facets).is_some());
            }
            None => bvh.occluded_many(rays.head(count), hidden.head_mut(count)),
        }
        for (chain, _) in chains.iter_mut().zip(hidden).filter(|(_, hidden)| *hidden) {
            *chain = None;
        }
        let mut hits = [None; BEAM_RAYS_TOGETHER];
        let mut known = mirrored.facets();
        while count > 0 {
            let mut left = 0;
            for at in 0..count {
                let Some(mut chain) = chains.at(at) else { continue };
                if let Some(ray) = self.mirrored(&mut chain, sequence)? {
                    rays.set(left, ray);
                    chains.set(left, Some(chain));
                    left += 1;
                }
            }
            match known.take() {
                Some(facets) => {
                    let all = rays.head(left).iter().zip(hits.head_mut(left));
                    all.for_each(|(ray, hit)| *hit = bvh.closest_among(ray, facets));
                }
                None => bvh.closest_many(rays.head(left), hits.head_mut(left)),
            }
            for (chain, hit) in chains.head_mut(left).iter_mut().zip(hits) {
                let surface = hit.and_then(|hit| {
                    stats.chain_rays += 1;
                    Surface::of_hit(scene, &hit)
                });
                *chain = chain.zip(surface).map(|(chain, surface)| Chain { surface, ..chain });
                if let Some(chain) = chain {
                    self.arrive(chain)?;
                }
            }
            count = left;
        }
        Some(())
    }

    /// Starts the chains of rays that leave a mirror toward the sun, and tells how many do.
    #[inline]
    fn start_chains(
        &self,
        (facet, side): (usize, usize),
        sequence: &Sequence,
        numbers: Range<u32>,
        (rays, chains): (&mut [Ray; BEAM_RAYS_TOGETHER], &mut [Option<Chain>; BEAM_RAYS_TOGETHER]),
    ) -> usize {
        let scene = self.scene;
        let mut count = 0;
        for index in numbers {
            let (p, q) = sequence.pair(index, 0);
            let (u, v) = triangle(p, q);
            let surface = Surface::new(scene, facet, side, u, v);
            let (s, t) = sequence.pair(index, 2);
            let toward = self.sun.sample(s, t);
            if toward.dot(surface.normal) > 0.0 {
                // flux per unit of normal irradiance, the first cosine still to come
                let (flux, path, arrival) = (scene.areas().at(facet), STRAIGHT, None);
                let axis = Some(-self.sun.direction());
                let chain =
                    Chain { index, surface, mirror: facet, direction: -toward, flux, path, arrival, axis };
                rays.set(count, surface.spawn_ray(toward));
                chains.set(count, Some(chain));
                count += 1;
            }
        }
        count
    }

    /// The ray by which a chain goes on from its mirror, if there is one and it matters.
    fn mirrored(&mut self, chain: &mut Chain, sequence: &Sequence) -> Option<Option<Ray>> {
        let (scene, surface) = (self.scene, chain.surface);
        let Some(mirror) = surface.mirror(scene) else { return Some(None) };
        let depth = self.builder.paths.get(chain.path).depth;
        if depth >= self.settings.mirrors {
            return Some(None);
        }
        chain.path = match self.builder.extend_path(chain.path, mirror.class, scene) {
            Ok(next) => next,
            Err(true) => return Some(None),
            Err(false) => return None,
        };
        if self.builder.paths.largest(chain.path) < self.settings.cutoff {
            return Some(None);
        }
        let lobe = mirror.lobe.is_some();
        chain.mirror = surface.facet;
        chain.axis = chain.axis.zip(surface.flat_mirror(scene)).map(|(axis, normal)| reflect(axis, normal));
        let (s, t) = if lobe { lobe_point(sequence, chain.index, depth) } else { (0.0, 0.0) };
        let (leaving, share) = surface.sample_reflection(scene, &mirror, chain.direction, s, t);
        let flat = !lobe && !scene.is_smooth();
        chain.flux *= share * turned(surface.normal, leaving, chain.arrival, flat);
        (chain.direction, chain.arrival) = (leaving, Some(leaving));
        Some(Some(surface.spawn_ray(leaving)))
    }

    /// Notes what a chain brings to the surface that it has met.
    fn arrive(&mut self, chain: &Chain) -> Option<()> {
        let Surface { facet, side, u, v, .. } = chain.surface;
        let target = self.elements.locate_within(facet, side, u, v);
        let area = self.elements.area(self.scene, target.0);
        let image = chain.axis.map_or(0, |axis| pack(-axis));
        let from = (image, if image == 0 { 0 } else { chain.mirror as u32 });
        self.builder.push(Record::beam(target, chain.path, chain.flux / area, from))
    }
}

/// The most facets that [`Ahead`] names: more of them cost a ray more than the tree does. With 12 the light of the counts' scene
/// takes 1.4 times the instructions (`cargo bench --bench counts`).
const AHEAD_FACETS: usize = 3;

/// Facets that may stand in the way of rays that leave a facet in almost one direction.
#[derive(Clone, Copy)]
struct Ahead {
    facets: [u32; AHEAD_FACETS],
    /// How many; more than [`AHEAD_FACETS`]: which is not known.
    count: usize,
}

impl Ahead {
    const NOTHING: Ahead = Ahead { facets: [0; AHEAD_FACETS], count: 0 };
    const UNKNOWN: Ahead = Ahead { count: usize::MAX, ..Ahead::NOTHING };

    /// Facets that reach into a region, the facet `own` apart.
    #[inline(never)]
    fn within(bvh: &Bvh<'_>, halves: &[HalfSpace; 4], own: u32) -> Ahead {
        let mut ahead = Ahead::NOTHING;
        bvh.within(halves, |facet| {
            if facet != own {
                ahead.facets.set(ahead.count, facet);
                ahead.count += 1;
            }
            ahead.count <= AHEAD_FACETS
        });
        ahead
    }

    fn facets(&self) -> Option<&[u32]> {
        self.facets.get(..self.count)
    }

    fn is_nothing(&self) -> bool {
        self.count == 0
    }
}

/// Rays of a mirror after which the row's records are merged.
const BEAM_RAYS_UNMERGED: usize = 32;

/// Rays that are traced together: they wait on the stack, which is small where there is no standard library.
const BEAM_RAYS_TOGETHER: usize = if cfg!(feature = "std") { BEAM_RAYS_UNMERGED } else { 1 };

/// Sunlight on its way from mirror to mirror.
#[derive(Clone, Copy)]
struct Chain {
    /// Number of its ray.
    index: u32,
    /// What it has met.
    surface: Surface,
    /// The last mirror before it, a facet.
    mirror: usize,
    direction: Vec3,
    /// Per unit of the sun's normal irradiance.
    flux: f64,
    path: u16,
    /// The direction in which it came from the mirror before.
    arrival: Option<Vec3>,
    /// The way of the light of the sun's middle, as long as flat mirrors turn it.
    axis: Option<Vec3>,
}

/// By how much a beam's flux changes at a mirror beside its reflectance: a mirror keeps radiance, so the flux
/// goes with the cosine at which it leaves over that at which it came (none yet for sunlight, whose flux per
/// normal irradiance gets its first cosine here). 1 at a flat ideal mirror.
fn turned(normal: Vec3, leaving: Vec3, arrival: Option<Vec3>, flat: bool) -> f64 {
    let out = leaving.dot(normal).max(0.0);
    match arrival {
        None => out,
        Some(_) if flat => 1.0,
        Some(d) => out / (-d.dot(normal)).max(1e-6),
    }
}

/// Adds the beams to the irradiance table of all unknowns, in the order of the mirrors, and notes which suns they come
/// from; what falls on an element falls on the part of it that is not inside a body.
pub fn add(
    beams: &Coupling<'_>,
    (coupling, elements): (&Coupling<'_>, &Elements<'_>),
    sun: &Sun<'_>,
    shape: TableShape,
    table: &mut [f64],
    images: &mut SunImagesMut<'_>,
) {
    for (_, row) in beams.rows(0..beams.unknowns()) {
        for record in row.targets {
            let (unknown, image) = (record.unknown(), record.image());
            if image != 0 {
                images.note(elements.facet_sides(), elements.facet_side(unknown), image, record.mirror());
            }
            let visible_share = f64::from(coupling.row(unknown).visible_share);
            if visible_share == 0.0 {
                continue;
            }
            images.spread(unknown, record, visible_share, |band| {
                sun.irradiance(band) * row.products(record.path()).at(band)
            });
            for level in (0..shape.levels).filter(|&l| shape.counts(row.depth(record.path()), l)) {
                let Some(mean) = table.get_mut(shape.at(unknown, level)) else { continue };
                for (band, (e, product)) in mean.iter_mut().zip(row.products(record.path())).enumerate() {
                    let irradiance = sun.irradiance(band) * product * (record.weight / visible_share);
                    *e += irradiance;
                    if image != 0 {
                        images.add(shape, unknown, level, band, irradiance);
                    }
                }
            }
        }
    }
}

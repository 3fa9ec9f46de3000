//! Rows of extended form factors: which share of an unknown's half circle shows which other unknowns, straight
//! or by way of mirrors and lobes, itself included, and which share the sky (eq. 12).

use crate::base::arena::plain_struct;
use crate::base::error::{Error, Field};
use crate::base::index::{IndexMut, pieces, span};
use crate::base::math::{clamp, floor, sqrt};
use crate::plane::light::Light;
use crate::plane::nodes::{graded, nodes};
use crate::plane::path::{Chains, Hit, PathState, Sink};
use crate::plane::scene::{PlaneScene, Primitive};
use crate::plane::scratch::{Scratch, sweep};
use crate::plane::view::{Span, distance};
use crate::plane::{Vec2, cross, length, toward};
use core::ops::Range;

/// How the half circle of an unknown is integrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The paper's: the exact form factor of each element seen times the radiance at its centre, and `chains`
    /// mirror chains for each element (0: no light by way of mirrors, which is wrong where there are any).
    Facets {
        /// Chains an element.
        chains: u32,
    },
    /// The half circle is split wherever the chain of mirrors changes, and each part takes a Gauss rule of so
    /// many points, graded toward its ends. The work does not depend on the number of elements.
    Split {
        /// Points a part.
        points: u32,
    },
}

/// How rows are computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowSettings {
    /// How the half circle is integrated.
    pub method: Method,
    /// Light reflected more often does not count, 1 to 64; `None`: by `cutoff`.
    pub max_bounces: Option<u32>,
    /// Chains end where their mirrors leave less than this share, at least 1e-15.
    pub cutoff: f64,
}

plain_struct! {
    /// What is known of a row.
    pub struct RowInfo {
        /// Light that chains could still bring which were cut, as a share of the brightest.
        pub lost: f64,
        /// Rays traced.
        pub rays: u32,
        /// 1 where the unknown sees something of the object.
        pub coupled: u32,
    }
}

/// Reflection counts told apart: one where all count, else the most that count.
pub fn classes(settings: &RowSettings) -> usize {
    settings.max_bounces.map_or(1, |most| most.clamp(1, 64) as usize)
}

/// Refuses more reflections than are told apart.
pub(crate) fn check_bounces(settings: &RowSettings) -> Result<(), Error> {
    match settings.max_bounces {
        Some(most) if !(1..=64).contains(&most) => {
            Err(Error::Range { field: Field::MaxBounces, band: 0, value: f64::from(most) })
        }
        _ => Ok(()),
    }
}

/// The class of a chain of `depth` mirrors, if it counts.
#[inline(always)]
pub(crate) fn class(depth: u32, settings: &RowSettings) -> Option<usize> {
    match settings.max_bounces {
        None => Some(0),
        Some(_) => Some(depth as usize).filter(|&d| d < classes(settings)),
    }
}

/// One row's job.
pub(crate) struct Gather<'a> {
    pub scene: &'a PlaneScene<'a>,
    pub settings: &'a RowSettings,
    /// The light, where its jumps matter.
    pub light: Option<&'a Light<'a>>,
}

/// Takes up one row of the matrix.
struct Row<'a> {
    scene: &'a PlaneScene<'a>,
    settings: &'a RowSettings,
    /// Weights of all unknowns, class by class.
    matrix: &'a mut [f64],
    /// Share of the half circle that escapes, by class.
    open: &'a mut [f64],
    info: RowInfo,
}

impl Sink for Row<'_> {
    fn meet(&mut self, hit: &Hit, state: &PathState) {
        let unknowns = self.scene.unknowns();
        self.info.rays += 1;
        self.info.coupled = 1;
        let Some(class) = class(state.depth, self.settings) else { return };
        let Some(part) = self.matrix.get_mut(class * unknowns..(class + 1) * unknowns) else { return };
        let v = self.scene.parameter(hit.primitive as usize, hit.point);
        for (unknown, weight) in self.scene.stencil(hit.primitive as usize, v).terms() {
            if let Some(entry) = part.get_mut(unknown) {
                *entry += state.throughput * weight;
            }
        }
    }

    fn escape(&mut self, state: &PathState) {
        if let Some(open) = class(state.depth, self.settings).and_then(|c| self.open.get_mut(c)) {
            *open += state.throughput;
        }
    }

    fn lost(&mut self, throughput: f64) {
        self.info.lost += throughput;
    }
}

/// Computes the rows of `range`: to `matrix`, for each row and class, the weights of all unknowns; to `open`,
/// for each row and class, what escapes to the sky; to `info` one entry a row. Rows of unknowns that reflect
/// nothing diffusely stay 0.
///
/// # Errors
/// [`Error::Range`] of the reflections that count; [`Error::Length`] where a slice does not fit the range;
/// [`Error::Mismatch`] where the scratch is another scene's.
pub fn fill(
    scene: &PlaneScene<'_>,
    settings: &RowSettings,
    range: Range<usize>,
    matrix: &mut [f64],
    open: &mut [f64],
    info: &mut [RowInfo],
    scratch: &mut Scratch<'_>,
) -> Result<(), Error> {
    check_bounces(settings)?;
    let (classes, unknowns) = (classes(settings), scene.unknowns());
    let rows = span(&range);
    let size = classes.saturating_mul(unknowns);
    for (what, expected, given) in [
        ("plane matrix", rows.saturating_mul(size), matrix.len()),
        ("open shares", rows.saturating_mul(classes), open.len()),
        ("row statistics", rows, info.len()),
    ] {
        if expected != given {
            return Err(Error::Length { what, expected, given });
        }
    }
    scratch.check(scene, 0)?;
    let outputs = pieces(matrix, size).zip(pieces(open, classes)).zip(info);
    for (unknown, ((matrix, open), info)) in range.zip(outputs) {
        matrix.fill(0.0);
        open.fill(0.0);
        let mut row = Row { scene, settings, matrix, open, info: RowInfo::default() };
        gather(&Gather { scene, settings, light: None }, unknown, &mut row, scratch);
        *info = row.info;
    }
    Ok(())
}

/// The point of a row, and what its rays have in common.
struct Station<'a> {
    chains: Chains<'a>,
    light: Option<&'a Light<'a>>,
    method: Method,
    cutoff: f64,
    point: Vec2,
    normal: Vec2,
    skip: u32,
}

/// Sends the half circle of an unknown through its chains into `sink`.
pub(crate) fn gather<S: Sink>(job: &Gather<'_>, unknown: usize, sink: &mut S, scratch: &mut Scratch<'_>) {
    let scene = job.scene;
    let (primitive, v) = scene.unknown(unknown);
    let Some(p) = scene.primitives().get(primitive) else { return };
    if scene.diffuse(p.material) == 0.0 {
        return;
    }
    let place = scene.place(primitive, v);
    let cuts = job.light.map_or(&[][..], Light::cuts);
    let uniform = job.light.is_none_or(Light::is_uniform);
    let sky_nodes = if uniform { 1 } else { 16 };
    // a row's light is reflected once more by the row itself
    let most = job.settings.max_bounces.map_or(u32::MAX, |most| most.clamp(1, 64) - 1);
    let station = Station {
        chains: Chains { scene, most, sky_nodes, cuts },
        light: job.light,
        method: job.settings.method,
        cutoff: job.settings.cutoff.max(1e-15),
        point: place.point,
        normal: place.normal,
        skip: primitive as u32,
    };
    let Some((spans, mut rest)) = sweep(scene, place.point, place.normal, station.skip, cuts, scratch) else {
        return;
    };
    for span in spans {
        let target = scene.primitives().get(span.primitive as usize);
        match (target, station.method) {
            (None, _) => station.sky(span, sink),
            (Some(p), Method::Facets { chains }) => station.facets(p, span, chains, sink, &mut rest),
            (Some(_), Method::Split { points }) => station.split(span, points as usize, sink, &mut rest),
        }
    }
}

impl Station<'_> {
    fn state(&self, s: f64, weight: f64) -> PathState {
        PathState {
            origin: self.point,
            direction: toward(self.normal, s),
            skip: self.skip,
            throughput: weight,
            floor: weight * self.cutoff,
            depth: 0,
            lobes: 0,
        }
    }

    /// A span of sky.
    fn sky<S: Sink>(&self, span: &Span, sink: &mut S) {
        let width = span.to - span.from;
        nodes(self.chains.sky_nodes, |x, w| {
            sink.escape(&self.state(span.from + width * x, 0.5 * width * w));
        });
    }

    /// A primitive's elements, one after the other, by the radiance at their centres.
    fn facets<S: Sink>(
        &self,
        p: &Primitive,
        span: &Span,
        chains: u32,
        sink: &mut S,
        scratch: &mut Scratch<'_>,
    ) {
        let scene = self.chains.scene;
        let count = f64::from(p.elements);
        let index = span.primitive as usize;
        // seen from its front, a primitive runs clockwise: its parameter falls while the sine rises
        let low = self.parameter(p, index, span.to) * count;
        let mut at = self.parameter(p, index, span.from) * count;
        if p.kind == 0 && at < low {
            at += count;
        }
        let mut from = span.from;
        while from < span.to {
            let edge = (-floor(-at) - 1.0).max(low); // the next whole number below
            let to = if edge > low { clamp(self.sine(index, edge / count), from, span.to) } else { span.to };
            let centre = floor(0.5 * (at + edge)) + 0.5;
            let weight = 0.5 * (to - from);
            if weight > 0.0 {
                self.element(index, centre / count, weight, sink);
                for i in 0..chains {
                    let part = (f64::from(i) + 0.5) / f64::from(chains);
                    let state = self.state(from + (to - from) * part, weight / f64::from(chains));
                    if let Some(hit) =
                        scene.first(state.origin, state.direction, state.skip).filter(|h| h.front)
                    {
                        self.chains.reflect(&hit, state, sink, scratch);
                    }
                }
            }
            if edge <= low {
                break;
            }
            (at, from) = (edge, to);
        }
    }

    /// Light straight from the element around parameter `v`, from its front.
    fn element<S: Sink>(&self, index: usize, v: f64, weight: f64, sink: &mut S) {
        let v = v - floor(v);
        let place = self.chains.scene.place(index, v);
        let away = place.point - self.point;
        let facing = self.chains.scene.primitives().get(index).is_some_and(|p| p.kind == 0)
            || place.normal.dot(away) < 0.0;
        if facing {
            let hit = Hit { primitive: index as u32, point: place.point, normal: place.normal, front: true };
            sink.meet(&hit, &self.state(0.0, weight));
        }
    }

    /// Parameter at which the direction of sine `s` meets a primitive, but for rounding.
    fn parameter(&self, p: &Primitive, index: usize, s: f64) -> f64 {
        let d = toward(self.normal, s);
        let t = distance(p, self.point, d);
        self.chains.scene.parameter(index, self.point + d * t)
    }

    /// Sine of the direction toward the point of parameter `v` of a primitive.
    fn sine(&self, index: usize, v: f64) -> f64 {
        let away = self.chains.scene.place(index, v - floor(v)).point - self.point;
        cross(self.normal, away) / length(away)
    }

    /// A span in parts within which the chain meets the same mirrors.
    fn split<S: Sink>(&self, span: &Span, points: usize, sink: &mut S, scratch: &mut Scratch<'_>) {
        let mut from = span.from;
        let mut part = |to: f64, sink: &mut S, scratch: &mut Scratch<'_>| {
            let width = to - from;
            // what a narrow part can be wrong by is a share of its width
            let n = match width {
                w if w > 0.03 => points,
                w if w > 1e-3 => points.min(4),
                w if w > 1e-5 => points.min(2),
                _ => 1,
            };
            graded(n, |x, w| {
                self.chains.follow(self.state(from + width * x, 0.5 * width * w), sink, scratch)
            });
            from = to;
        };
        if self.chains.scene.mirrors() || self.light.is_some_and(|l| l.sun().is_some()) {
            let probe = |i: usize| {
                let x = (i as f64 + 0.5) / PROBES as f64;
                let s = span.from + (span.to - span.from) * x * x * (3.0 - 2.0 * x);
                Probe { s, signature: self.signature(s) }
            };
            let bisections = if points <= 6 { 11 } else { BISECTIONS };
            let mut before = probe(0);
            for i in 1..PROBES {
                let next = probe(i);
                self.changes(before, next, bisections, |s| part(s, sink, scratch));
                before = next;
            }
        }
        part(span.to, sink, scratch);
    }

    /// Calls `change` with the sines between two probes at which the chain changes, in order, each found by
    /// `bisections` bisections.
    fn changes(&self, mut a: Probe, mut b: Probe, bisections: usize, mut change: impl FnMut(f64)) {
        // ends of the intervals to the right, and the bisections that are left for them
        let (mut ends, mut waiting, mut depth) = ([(b, 0); BISECTIONS], 0, bisections);
        loop {
            let s = 0.5 * (a.s + b.s);
            if a.signature != b.signature && depth > 0 && waiting < BISECTIONS {
                depth -= 1;
                ends.set(waiting, (b, depth));
                waiting += 1;
                b = Probe { s, signature: self.signature(s) };
                continue;
            }
            if a.signature != b.signature {
                change(s);
            }
            let Some(&(end, left)) = waiting.checked_sub(1).and_then(|w| ends.get(w)) else { return };
            waiting -= 1;
            (a, b, depth) = (b, end, left);
        }
    }

    /// A number that tells apart which mirrors the chain along sine `s` meets, whether the sun shines on them,
    /// and where it escapes; mirrors that bring less than the root of the cutoff do not count.
    fn signature(&self, s: f64) -> u64 {
        let scene = self.chains.scene;
        let mut state = self.state(s, 1.0);
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        let mut mix = |value: u64| hash = (hash ^ value).wrapping_mul(0x0000_0100_0000_01b3);
        let sun = self.light.filter(|l| l.sun().is_some());
        let mut normal = self.normal;
        let faintest = sqrt(self.cutoff);
        while state.throughput > faintest && state.depth <= self.chains.most.min(LONGEST_TOLD_APART) {
            let Some(hit) = scene.first(state.origin, state.direction, state.skip) else {
                // chains that escape to either side of a trapped one
                mix(u64::from(cross(normal, state.direction) > 0.0));
                for (i, cut) in self.chains.cuts.iter().enumerate() {
                    mix((i as u64) << 1 | u64::from(cross(*cut, state.direction) > 0.0));
                }
                break;
            };
            mix(u64::from(hit.primitive) + 0x100);
            let Some(p) = scene.primitives().get(hit.primitive as usize).filter(|_| hit.front) else { break };
            if let Some(light) = sun {
                mix(u64::from(light.sunlit(scene, hit.point, hit.normal, hit.primitive) > 0.0));
            }
            if scene.lobe(p.material).is_some() {
                break;
            }
            normal = hit.normal;
            let mirrored = scene.mirrored(&hit, state.direction);
            let throughput = state.throughput * scene.specular(p.material);
            state = PathState {
                origin: hit.point,
                direction: mirrored,
                skip: hit.primitive,
                throughput,
                ..state
            };
            state.depth += 1;
        }
        hash
    }
}

/// Longer chains are told apart by their first mirrors alone: between perfect mirrors they need not end.
const LONGEST_TOLD_APART: u32 = 256;

/// First guesses a span at where chains change.
const PROBES: usize = 12;
/// Halvings of the interval between two in which the chain changes, at most.
const BISECTIONS: usize = 16;

/// The chain along one direction.
#[derive(Clone, Copy)]
struct Probe {
    s: f64,
    signature: u64,
}

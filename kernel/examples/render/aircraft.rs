//! The built-in aircraft: a closed, watertight triangle mesh made by code.
//!
//! The nose points along +x, the left wing along +y, z is up; lengths are in an arbitrary unit (the body is 15
//! long). The left half is a lofted skin of rings around the x axis; wing, tail planes, fin and engine inlet
//! grow out of rectangular patches of that skin, whose facets they replace, so the mesh is closed by
//! construction and its parts are stitched rather than pushed through each other. The right half is the mirror
//! image. Only operations that IEEE 754 rounds correctly are used: the vertices are the same bits everywhere.

use std::array::from_fn;

/// A position or direction: x, y, z.
type Point = [f64; 3];

/// Eye of the view suggested for the aircraft: from ahead, its left and above, into the inlets.
pub const CAMERA_EYE: Point = [15.0, 7.0, 6.0];
/// Point in the middle of the suggested image.
pub const CAMERA_TARGET: Point = [-1.0, 0.6, 0.8];
/// Direction that is up in the suggested image.
pub const CAMERA_UP: Point = [0.0, 0.0, 1.0];
/// Height of the suggested square, orthographic image, in the mesh's unit.
pub const CAMERA_HEIGHT: f64 = 11.0;

/// A triangle mesh: closed, every edge shared by exactly two facets.
pub struct Model {
    /// Vertex positions, each used by some facet.
    pub vertices: Vec<[f64; 3]>,
    /// Vertex indices of the facets, counter-clockwise seen from outside.
    pub facets: Vec<[u32; 3]>,
}

/// Columns of quads in a ring of the left half, from the keel (column 0) up to the spine.
const COLUMNS: usize = 10;

/// Control section of the skin: x, half-width, height above and below the axis, squareness (0: elliptic, 1: the
/// fourth-power superellipse), height that the canopy adds at the spine.
type Section = [f64; 6];

/// The skin ahead of the inlets, from the tip of the nose.
const FOREBODY: [Section; 7] = [
    [7.5, 0.0, 0.0, 0.0, 0.0, 0.0],
    [7.2, 0.13, 0.11, 0.12, 0.0, 0.0],
    [6.4, 0.33, 0.26, 0.30, 0.0, 0.0],
    [5.4, 0.51, 0.40, 0.45, 0.0, 0.02],
    [4.4, 0.62, 0.48, 0.54, 0.1, 0.42],
    [3.4, 0.67, 0.52, 0.60, 0.2, 0.56],
    [2.4, 0.68, 0.54, 0.64, 0.3, 0.46],
];

/// The skin behind the lips of the inlets, to the rim of the nozzle.
const AFTBODY: [Section; 7] = [
    [1.7, 1.42, 0.57, 0.63, 0.9, 0.36],
    [0.9, 1.52, 0.61, 0.69, 0.9, 0.22],
    [-1.0, 1.55, 0.62, 0.68, 0.9, 0.08],
    [-3.0, 1.42, 0.62, 0.66, 0.8, 0.02],
    [-4.8, 1.15, 0.60, 0.62, 0.6, 0.0],
    [-6.2, 0.84, 0.57, 0.58, 0.2, 0.0],
    [-7.3, 0.60, 0.50, 0.50, 0.0, 0.0],
];

/// Where the rings ahead of the inlets stand.
const FORE_RINGS: [f64; 9] = [7.25, 6.7, 6.1, 5.5, 4.9, 4.3, 3.7, 3.05, 2.4];

/// Where the rings behind the inlets stand; leading and trailing edges of wing, fin and tail plane meet one each.
const AFT_RINGS: [f64; 21] = [
    1.7, 1.3, 0.9, 0.5, 0.05, -0.4, -0.85, -1.3, -1.75, -2.2, -2.65, -3.05, -3.45, -3.9, -4.35, -4.8, -5.2,
    -5.6, -6.0, -6.4, -6.85,
];

/// Rings of the nozzle, as x and radius: over its rim, inward, and over the back wall to the exhaust cone.
const NOZZLE_RINGS: [[f64; 2]; 4] = [[-7.3, 0.43], [-6.95, 0.42], [-6.6, 0.4], [-6.6, 0.2]];

/// Half the thickness of trailing edges.
const EDGE: f64 = 0.025;

/// Ring that carries the inner edge of the inlet; the step out to the lip takes two rows of quads.
const INLET_RING: usize = FORE_RINGS.len() - 1;
/// First ring behind the inlet.
const AFT: usize = INLET_RING + 2;

/// A surface with an aerofoil section that grows out of the skin.
struct Wing {
    /// Ring at the leading edge of the root.
    ring: usize,
    /// Quads along the chord.
    chordwise: usize,
    /// Lower (tail plane, wing) or outer (fin) of its two columns of quads.
    column: usize,
    /// Bands of quads along the span.
    spanwise: usize,
    /// Position across the chord plane at the root: z of a wing, y of a fin.
    offset: f64,
    /// Leading edge of the tip.
    tip: Point,
    /// Chord of the tip.
    tip_chord: f64,
    /// Thickness over chord at root and tip.
    thickness: [f64; 2],
    /// Stands upright: thick along y rather than z.
    upright: bool,
}

const WINGS: [Wing; 3] = [
    Wing {
        ring: AFT + 2,
        chordwise: 9,
        column: 4,
        spanwise: 7,
        offset: 0.05,
        tip: [-2.0, 5.2, -0.05],
        tip_chord: 1.3,
        thickness: [0.075, 0.055],
        upright: false,
    },
    Wing {
        ring: AFT + 15,
        chordwise: 4,
        column: 4,
        spanwise: 4,
        offset: 0.0,
        tip: [-6.3, 3.0, -0.05],
        tip_chord: 0.85,
        thickness: [0.08, 0.06],
        upright: false,
    },
    Wing {
        ring: AFT + 12,
        chordwise: 5,
        column: 7,
        spanwise: 4,
        offset: 0.8,
        tip: [-5.2, 1.5, 2.5],
        tip_chord: 1.0,
        thickness: [0.08, 0.06],
        upright: true,
    },
];

/// The built-in aircraft.
pub fn aircraft() -> Model {
    let mut half = Half::lofted();
    for wing in &WINGS {
        half.grow_wing(wing);
    }
    half.sink_inlet();
    half.skin_over();
    half.mirrored()
}

/// The left half while it grows; the skin's ring r, column line c is vertex r (COLUMNS + 1) + c.
struct Half {
    model: Model,
    /// Rings of the skin, poles not counted.
    rings: usize,
    /// Quads of the skin that a part has replaced, as [ring][column].
    replaced: Vec<[bool; COLUMNS]>,
}

/// A rectangle of skin quads.
struct Patch {
    /// First ring and column line.
    ring: usize,
    column: usize,
    /// Quads along the body and around it.
    rows: usize,
    columns: usize,
}

impl Half {
    /// The rings of the skin, without facets.
    fn lofted() -> Self {
        let fore = FORE_RINGS.map(|x| ring(&FOREBODY, x));
        let aft = AFT_RINGS.map(|x| ring(&AFTBODY, x));
        let step: [Point; COLUMNS + 1] = from_fn(|c| mix(fore[INLET_RING][c], aft[0][c], 0.5));
        let rim = ring(&AFTBODY, AFTBODY[AFTBODY.len() - 1][0]);
        let nozzle =
            NOZZLE_RINGS.map(|[x, r]| from_fn(|c| skin(x, [r, r, r, 0.0, 0.0], height_parameter(c))));
        let rings: Vec<_> = fore.into_iter().chain([step]).chain(aft).chain([rim]).chain(nozzle).collect();
        Self {
            rings: rings.len(),
            replaced: vec![[false; COLUMNS]; rings.len()],
            model: Model { vertices: rings.concat(), facets: Vec::new() },
        }
    }

    /// Lets a wing, tail plane or fin grow out of the skin.
    fn grow_wing(&mut self, wing: &Wing) {
        let patch = Patch { ring: wing.ring, column: wing.column, rows: wing.chordwise, columns: 2 };
        let x: Vec<f64> = (0..=wing.chordwise).map(|u| AFT_RINGS[wing.ring - AFT + u]).collect();
        let chord = x[0] - x[wing.chordwise];
        // The leading edge is rounded by corners close behind it.
        let fraction = |u: usize, v: usize| match (u, v) {
            (0, 1) => 0.0,
            (0, _) => 0.2 * (x[0] - x[1]) / chord,
            _ => (x[0] - x[u]) / chord,
        };
        // Columns run upward on the flank, and inward on the back, where a fin stands.
        let across = |u: usize, v: usize, thickness: f64| {
            let side = if wing.upright { 1.0 - v as f64 } else { v as f64 - 1.0 };
            side * half_thickness(thickness, fraction(u, v))
        };
        for (u, v) in patch.outline() {
            let root_x = x[0] - chord * fraction(u, v);
            let target = wing.offset + across(u, v, chord * wing.thickness[0]);
            self.model.vertices[patch.vertex(u, v)] = on_skin(root_x, target, wing.upright);
        }
        let [axis, span] = if wing.upright { [1, 2] } else { [2, 1] };
        self.extrude(&patch, wing.spanwise, |u, v| {
            let mut p = wing.tip;
            p[0] -= wing.tip_chord * fraction(u, v);
            p[axis] += across(u, v, wing.tip_chord * wing.thickness[1]);
            if v == 1 {
                // The tip bulges along its middle.
                p[span] += half_thickness(wing.tip_chord * wing.thickness[1], fraction(u, v));
            }
            p
        });
    }

    /// Sinks the duct of the engine inlet, with a round, slightly hollow back wall, behind the step of the skin.
    fn sink_inlet(&mut self) {
        let patch = Patch { ring: INLET_RING, column: 2, rows: 2, columns: 5 };
        self.extrude(&patch, 5, |u, v| {
            let (a, b) = (u as f64 - 1.0, 0.4 * v as f64 - 1.0);
            // Maps the square of the patch to the disc of the wall.
            let (y, z) = (a * (1.0 - 0.5 * b * b).sqrt(), b * (1.0 - 0.5 * a * a).sqrt());
            [-0.3 - 0.15 * (1.0 - y * y - z * z), 0.7 + 0.42 * y, -0.04 + 0.42 * z]
        });
    }

    /// Replaces a patch by straight walls from its outline to that of `end`, and by `end` itself.
    fn extrude(&mut self, patch: &Patch, bands: usize, end: impl Fn(usize, usize) -> Point) {
        let mut ids: Vec<Vec<usize>> =
            (0..=patch.rows).map(|u| (0..=patch.columns).map(|v| patch.vertex(u, v)).collect()).collect();
        let outline = patch.outline();
        let root: Vec<Point> = outline.iter().map(|&(u, v)| self.model.vertices[ids[u][v]]).collect();
        for band in 1..=bands {
            let before: Vec<usize> = outline.iter().map(|&(u, v)| ids[u][v]).collect();
            for (&(u, v), &from) in outline.iter().zip(&root) {
                ids[u][v] = self.model.vertices.len();
                self.model.vertices.push(mix(from, end(u, v), band as f64 / bands as f64));
            }
            for (k, &a) in before.iter().enumerate() {
                let next = (k + 1) % outline.len();
                let [after, after_next] = [k, next].map(|k| ids[outline[k].0][outline[k].1]);
                self.quad([a, before[next], after_next, after]);
            }
        }
        // What lay inside the patch moves to the inside of its end.
        for (u, row) in ids.iter().enumerate().take(patch.rows).skip(1) {
            for (v, &id) in row.iter().enumerate().take(patch.columns).skip(1) {
                self.model.vertices[id] = end(u, v);
            }
        }
        for u in 0..patch.rows {
            for v in 0..patch.columns {
                self.replaced[patch.ring + u][patch.column + v] = true;
                self.quad([ids[u][v], ids[u + 1][v], ids[u + 1][v + 1], ids[u][v + 1]]);
            }
        }
    }

    /// Covers what is left of the skin, and closes it at the tip of the nose and of the exhaust cone.
    fn skin_over(&mut self) {
        let vertex = |r: usize, c: usize| r * (COLUMNS + 1) + c;
        let nose = self.model.vertices.len();
        self.model.vertices.extend([[FOREBODY[0][0], 0.0, 0.0], [-7.0, 0.0, 0.0]]);
        let last = self.rings - 1;
        for c in 0..COLUMNS {
            self.facet([nose, vertex(0, c), vertex(0, c + 1)]);
            self.facet([vertex(last, c), nose + 1, vertex(last, c + 1)]);
        }
        for r in 0..last {
            for c in 0..COLUMNS {
                if !self.replaced[r][c] {
                    self.quad([vertex(r, c), vertex(r + 1, c), vertex(r + 1, c + 1), vertex(r, c + 1)]);
                }
            }
        }
    }

    /// Both halves, which share the vertices in the plane y = 0.
    fn mirrored(self) -> Model {
        let Model { mut vertices, mut facets } = self.model;
        let mut twin = Vec::with_capacity(vertices.len());
        for id in 0..vertices.len() {
            let [x, y, z] = vertices[id];
            if y == 0.0 {
                twin.push(id as u32);
            } else {
                twin.push(vertices.len() as u32);
                vertices.push([x, -y, z]);
            }
        }
        let right: Vec<_> = facets.iter().map(|f| [f[0], f[2], f[1]].map(|id| twin[id as usize])).collect();
        facets.extend(right);
        Model { vertices, facets }
    }

    /// Adds a quad, cut along its shorter diagonal.
    fn quad(&mut self, [a, b, c, d]: [usize; 4]) {
        let length = |i: usize, j: usize| {
            let [p, q] = [i, j].map(|k| self.model.vertices[k]);
            (0..3).map(|k| (p[k] - q[k]) * (p[k] - q[k])).sum::<f64>()
        };
        if length(a, c) <= length(b, d) {
            self.facet([a, b, c]);
            self.facet([a, c, d]);
        } else {
            self.facet([a, b, d]);
            self.facet([b, c, d]);
        }
    }

    fn facet(&mut self, ids: [usize; 3]) {
        self.model.facets.push(ids.map(|id| id as u32));
    }
}

impl Patch {
    /// Vertex of the skin at row u, column line v of the patch.
    fn vertex(&self, u: usize, v: usize) -> usize {
        (self.ring + u) * (COLUMNS + 1) + self.column + v
    }

    /// The patch's outline as (u, v), counter-clockwise seen from outside.
    fn outline(&self) -> Vec<(usize, usize)> {
        let (m, n) = (self.rows, self.columns);
        let there = (0..m).map(|u| (u, 0)).chain((0..n).map(|v| (m, v)));
        let back = (1..=m).rev().map(|u| (u, n)).chain((1..=n).rev().map(|v| (0, v)));
        there.chain(back).collect()
    }
}

/// Half the thickness, at a fraction of the chord behind the leading edge, of an aerofoil with given greatest
/// thickness and a blunt trailing edge.
fn half_thickness(thickness: f64, fraction: f64) -> f64 {
    // The factor makes the largest value of sqrt(f) (1 - f), at f = 1/3, a half.
    1.299 * thickness * fraction.sqrt() * (1.0 - fraction) + EDGE * fraction
}

/// The height parameter of a column line, -1 at the keel and 1 at the spine.
fn height_parameter(column: usize) -> f64 {
    2.0 * column as f64 / COLUMNS as f64 - 1.0
}

/// One ring of the skin.
fn ring(sections: &[Section], x: f64) -> [Point; COLUMNS + 1] {
    let section = section_at(sections, x);
    from_fn(|c| skin(x, section, height_parameter(c)))
}

/// The section at x: cubic interpolation, with the slopes of the chords between neighbours.
fn section_at(sections: &[Section], x: f64) -> [f64; 5] {
    let last = sections.len() - 1;
    let k = sections.iter().skip(1).position(|s| s[0] <= x).map_or(last - 1, |k| k.min(last - 1));
    let slope = |k: usize, i: usize| {
        let (a, b) = (sections[k.saturating_sub(1)], sections[(k + 1).min(last)]);
        (b[i] - a[i]) / (b[0] - a[0])
    };
    let (a, b) = (sections[k], sections[k + 1]);
    let width = b[0] - a[0];
    let t = (x - a[0]) / width;
    let (t2, t3) = (t * t, t * t * t);
    from_fn(|i| {
        let i = i + 1;
        let ends = a[i] + (b[i] - a[i]) * (3.0 * t2 - 2.0 * t3);
        ends + width * (slope(k, i) * (t3 - 2.0 * t2 + t) + slope(k + 1, i) * (t3 - t2))
    })
}

/// Point of a section at height parameter t.
fn skin(x: f64, [width, top, bottom, squareness, canopy]: [f64; 5], t: f64) -> Point {
    let c = 1.0 - t.abs();
    let elliptic = (c * c + t * t).sqrt();
    let squared = (c * c * c * c + t * t * t * t).sqrt().sqrt();
    let norm = elliptic + (squared - elliptic) * squareness;
    let height = if t < 0.0 { bottom } else { top };
    let above = t.max(0.0);
    let rise = above * above * (3.0 - 2.0 * above);
    [x, width * c / norm, height * t / norm + canopy * rise * rise]
}

/// Point of the aft skin with a given z on the flank, or with a given y on the back.
fn on_skin(x: f64, target: f64, back: bool) -> Point {
    let section = section_at(&AFTBODY, x);
    let (mut low, mut high) = if back { (0.0, 1.0) } else { (-1.0, 1.0) };
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let p = skin(x, section, middle);
        if if back { p[1] > target } else { p[2] < target } {
            low = middle;
        } else {
            high = middle;
        }
    }
    skin(x, section, low)
}

/// Linear interpolation.
fn mix(a: Point, b: Point, t: f64) -> Point {
    from_fn(|k| a[k] + (b[k] - a[k]) * t)
}

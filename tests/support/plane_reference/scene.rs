//! Circles and segments, rays and what a point sees.

use std::f64::consts::FRAC_PI_2;

/// A point or direction.
pub type V = [f64; 2];

pub fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

pub fn cross(a: V, b: V) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

pub fn sub(a: V, b: V) -> V {
    [a[0] - b[0], a[1] - b[1]]
}

/// a + t b.
pub fn along(a: V, t: f64, b: V) -> V {
    [a[0] + t * b[0], a[1] + t * b[1]]
}

pub fn norm(a: V) -> f64 {
    dot(a, a).sqrt()
}

pub fn reflect(d: V, n: V) -> V {
    along(d, -2.0 * dot(d, n), n)
}

/// The direction at the angle `theta` (counter-clockwise) from the unit vector `n`.
pub fn at_angle(n: V, theta: f64) -> V {
    let (s, c) = theta.sin_cos();
    [n[0] * c - n[1] * s, n[1] * c + n[0] * s]
}

/// A surface.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// Seen from outside.
    Circle { centre: V, radius: f64 },
    /// Front on the right of a -> b; the back is black.
    Segment { a: V, b: V },
}

/// A surface with its reflectances.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    pub shape: Shape,
    pub diffuse: f64,
    pub specular: f64,
    /// Axis ratio of the lobe that takes the mirror's place.
    pub lobe: Option<f64>,
}

/// A scene.
#[derive(Clone, Debug)]
pub struct Scene {
    pub surfaces: Vec<Surface>,
}

/// A first hit: surface, point, unit normal, and whether the front is met.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    pub surface: usize,
    pub point: V,
    pub normal: V,
    pub front: bool,
}

impl Surface {
    /// The point of parameter `t` (turns, or share of the length) and its normal.
    pub fn place(&self, t: f64) -> (V, V) {
        match self.shape {
            Shape::Circle { centre, radius } => {
                let (s, c) = (t * std::f64::consts::TAU).sin_cos();
                (along(centre, radius, [c, s]), [c, s])
            }
            Shape::Segment { a, b } => {
                let d = sub(b, a);
                let l = norm(d);
                (along(a, t, d), [d[1] / l, -d[0] / l])
            }
        }
    }

    /// The parameter of a point.
    pub fn parameter(&self, p: V) -> f64 {
        match self.shape {
            Shape::Circle { centre, .. } => {
                let d = sub(p, centre);
                (d[1].atan2(d[0]) / std::f64::consts::TAU).rem_euclid(1.0)
            }
            Shape::Segment { a, b } => {
                let d = sub(b, a);
                (dot(sub(p, a), d) / dot(d, d)).clamp(0.0, 1.0)
            }
        }
    }

    /// Length of the boundary.
    pub fn size(&self) -> f64 {
        match self.shape {
            Shape::Circle { radius, .. } => std::f64::consts::TAU * radius,
            Shape::Segment { a, b } => norm(sub(b, a)),
        }
    }

    fn distance(&self, o: V, d: V) -> Option<f64> {
        match self.shape {
            Shape::Circle { centre, radius } => {
                let a = sub(centre, o);
                let square = radius * radius - cross(a, d).powi(2);
                let t = dot(a, d) - (square > 0.0).then(|| square.sqrt())?;
                (t > 0.0).then_some(t)
            }
            Shape::Segment { a, b } => {
                let (a, b) = (sub(a, o), sub(b, o));
                let (ca, cb) = (cross(d, a), cross(d, b));
                if (ca >= 0.0) == (cb >= 0.0) {
                    return None;
                }
                let t = dot(along(a, ca / (ca - cb), sub(b, a)), d);
                (t > 0.0).then_some(t)
            }
        }
    }
}

impl Scene {
    /// The first hit of a ray that leaves the surface `skip`.
    pub fn first(&self, o: V, d: V, skip: usize) -> Option<Hit> {
        let mut best: Option<(f64, usize)> = None;
        for (i, s) in self.surfaces.iter().enumerate().filter(|&(i, _)| i != skip) {
            if let Some(t) = s.distance(o, d)
                && best.is_none_or(|(least, _)| t < least)
            {
                best = Some((t, i));
            }
        }
        let (t, surface) = best?;
        let point = along(o, t, d);
        let s = &self.surfaces[surface];
        let normal = match s.shape {
            Shape::Circle { centre, .. } => {
                let d = sub(point, centre);
                [d[0] / norm(d), d[1] / norm(d)]
            }
            Shape::Segment { .. } => s.place(0.5).1,
        };
        let point = match s.shape {
            Shape::Circle { centre, radius } => along(centre, radius, normal),
            Shape::Segment { .. } => point,
        };
        Some(Hit { surface, point, normal, front: dot(normal, d) < 0.0 })
    }

    /// Angles to the normal `n` at `x` at which what is seen may change, with both horizons, ascending.
    pub fn silhouettes(&self, x: V, n: V, skip: usize) -> Vec<f64> {
        let mut angles = vec![-FRAC_PI_2, FRAC_PI_2];
        let angle = |d: V| cross(n, d).atan2(dot(n, d));
        for (_, s) in self.surfaces.iter().enumerate().filter(|&(i, _)| i != skip) {
            match s.shape {
                Shape::Circle { centre, radius } => {
                    let d = sub(centre, x);
                    let half = (radius / norm(d)).min(1.0).asin();
                    angles.extend([angle(at_angle(d, half)), angle(at_angle(d, -half))]);
                }
                Shape::Segment { a, b } => angles.extend([angle(sub(a, x)), angle(sub(b, x))]),
            }
        }
        angles.retain(|a| a.abs() <= FRAC_PI_2);
        angles.sort_by(f64::total_cmp);
        angles.dedup_by(|a, b| *a - *b < 1e-14);
        angles
    }

    /// Parts of the half circle: from, to, and what is seen (`None`: the sky).
    pub fn parts(&self, x: V, n: V, skip: usize) -> Vec<(f64, f64, Option<usize>)> {
        let angles = self.silhouettes(x, n, skip);
        let seen = |a: f64, b: f64| self.first(x, at_angle(n, 0.5 * (a + b)), skip).map(|h| h.surface);
        angles.windows(2).map(|w| (w[0], w[1], seen(w[0], w[1]))).collect()
    }

    /// Whether anything of the object rises above the horizon of a point.
    pub fn coupled(&self, x: V, n: V, skip: usize) -> bool {
        self.parts(x, n, skip).iter().any(|p| p.2.is_some())
    }

    /// The rays of an orthographic view from the direction (sin g, cos g): centres of `m` cells across the object.
    pub fn view(&self, g: f64, m: usize) -> Vec<(V, V)> {
        let (s, c) = g.sin_cos();
        let (v, e) = ([s, c], [c, -s]);
        let (mut low, mut high, mut far) = (f64::MAX, f64::MIN, 0.0f64);
        for surface in &self.surfaces {
            let (ends, r) = match surface.shape {
                Shape::Circle { centre, radius } => ([centre, centre], radius),
                Shape::Segment { a, b } => ([a, b], 0.0),
            };
            for p in ends {
                (low, high) = (low.min(dot(p, e) - r), high.max(dot(p, e) + r));
                far = far.max(norm(p) + r);
            }
        }
        let at = |i: usize| low + (high - low) * (i as f64 + 0.5) / m as f64;
        (0..m).map(|i| (along([v[0] * 3.0 * far, v[1] * 3.0 * far], at(i), e), [-v[0], -v[1]])).collect()
    }
}

//! Diffuse surfaces and ideal mirrors: eq. (12) by Nystrom's method and eq. (15).

use super::scene::{Scene, Shape, V, at_angle, cross, reflect};
use super::{gauss, graded};

/// Radiance of the sky by direction.
pub type Sky<'a> = &'a (dyn Fn(V) -> f64 + Sync);

/// How finely everything is cut.
#[derive(Clone, Copy, Debug)]
pub struct Resolution {
    /// Panels of the whole boundary of each surface, halving toward the ends of segments.
    pub panels: usize,
    /// Gauss points of a panel.
    pub order: usize,
    /// Directions of a part of the half circle.
    pub points: usize,
    /// Uniform probes between silhouettes at which changes of the chain are sought.
    pub probes: usize,
}

impl Resolution {
    /// 2e-6 on two circles at half a radius' distance.
    pub const FINE: Resolution = Resolution { panels: 24, order: 6, points: 16, probes: 24 };
    /// 2e-7 there.
    pub const FINEST: Resolution = Resolution { panels: 32, order: 6, points: 24, probes: 48 };
}

/// Mirrors that bring less end a chain.
const FAINTEST: f64 = 1e-10;
/// Changes of chains that bring less are not sought.
const UNSEEN: f64 = 1e-4;

/// A hit of the chain along a direction: surface, parameter, product of the mirrors before it, mirrors before it.
struct Met {
    surface: usize,
    parameter: f64,
    through: f64,
    depth: usize,
}

/// The chain of a ray: what it meets, and with which direction and product it escapes.
fn chain(
    scene: &Scene,
    mut o: V,
    mut d: V,
    mut skip: usize,
    most: usize,
) -> (Vec<Met>, Option<(V, f64, usize)>) {
    let (mut met, mut through) = (Vec::new(), 1.0);
    for depth in 0.. {
        let Some(hit) = scene.first(o, d, skip) else { return (met, Some((d, through, depth))) };
        if !hit.front {
            break;
        }
        let surface = &scene.surfaces[hit.surface];
        met.push(Met { surface: hit.surface, parameter: surface.parameter(hit.point), through, depth });
        through *= surface.specular;
        if through < FAINTEST || depth >= most {
            break;
        }
        (o, d, skip) = (hit.point, reflect(d, hit.normal), hit.surface);
    }
    (met, None)
}

/// Which surfaces the chain meets while it brings anything to speak of.
fn signature(scene: &Scene, mut o: V, mut d: V, mut skip: usize, jumps: &[V]) -> Vec<usize> {
    let (mut list, mut through, mut normal) = (Vec::new(), 1.0, [0.0; 2]);
    while through > UNSEEN {
        let Some(hit) = scene.first(o, d, skip) else {
            // chains that escape to either side of a trapped one
            list.push(900 + usize::from(cross(normal, d) > 0.0));
            list.extend(jumps.iter().map(|&j| 1000 + usize::from(cross(j, d) > 0.0)));
            break;
        };
        list.push(hit.surface);
        if !hit.front {
            break;
        }
        through *= scene.surfaces[hit.surface].specular;
        (o, d, skip, normal) = (hit.point, reflect(d, hit.normal), hit.surface, hit.normal);
    }
    list
}

/// Angles at which the chain of rays from `x` changes, horizons included.
fn cuts(scene: &Scene, x: V, n: V, skip: usize, probes: usize, jumps: &[V]) -> Vec<f64> {
    let sign = |a: f64| signature(scene, x, at_angle(n, a), skip, jumps);
    let coarse = scene.silhouettes(x, n, skip);
    let mut all = coarse.clone();
    for w in coarse.windows(2) {
        let at: Vec<f64> = graded(probes).iter().map(|(t, _)| w[0] + (w[1] - w[0]) * t).collect();
        let signs: Vec<_> = at.iter().map(|&a| sign(a)).collect();
        for i in 1..probes {
            let mut open = vec![(at[i - 1], signs[i - 1].clone(), at[i], signs[i].clone())];
            while let Some((a, sa, b, sb)) = open.pop() {
                if sa == sb {
                    continue;
                }
                let middle = 0.5 * (a + b);
                if b - a < 1e-11 {
                    all.push(middle);
                    continue;
                }
                let sm = sign(middle);
                open.push((a, sa, middle, sm.clone()));
                open.push((middle, sm, b, sb));
            }
        }
    }
    all.sort_by(f64::total_cmp);
    all
}

/// A solved scene.
pub struct Solution<'a> {
    scene: &'a Scene,
    sky: Sky<'a>,
    /// Ends of the panels of each surface, in its parameter.
    panels: Vec<Vec<f64>>,
    /// First node of each surface.
    first: Vec<usize>,
    order: usize,
    nodes: Vec<f64>,
    /// Most reflections; `None`: all count.
    bounces: Option<usize>,
    /// Diffuse radiance of the nodes by light of 1, 2, ... reflections at most, or of all.
    pub levels: Vec<Vec<f64>>,
}

impl<'a> Solution<'a> {
    /// Solves for the diffuse radiance under a sky that jumps at most at `jumps`.
    pub fn new(
        scene: &'a Scene,
        sky: Sky<'a>,
        jumps: &[V],
        bounces: Option<usize>,
        r: Resolution,
    ) -> Solution<'a> {
        let panels: Vec<Vec<f64>> = scene.surfaces.iter().map(|s| ends(&s.shape, r.panels)).collect();
        let mut first = vec![0];
        for p in &panels {
            first.push(first[first.len() - 1] + (p.len() - 1) * r.order);
        }
        let nodes = gauss(r.order).iter().map(|n| n.0).collect();
        let mut solution =
            Solution { scene, sky, panels, first, order: r.order, nodes, bounces, levels: Vec::new() };
        let classes = bounces.map_or(1, |b| b.max(1));
        let count = solution.first[scene.surfaces.len()];
        let mut matrix = vec![vec![0.0; count * classes]; count];
        let mut direct = vec![vec![0.0; classes]; count];
        for (k, (row, direct)) in matrix.iter_mut().zip(&mut direct).enumerate() {
            solution.row(k, jumps, r, row, direct);
        }
        solution.solve(&matrix, &direct, classes);
        solution
    }

    /// Surface and parameter of a node.
    fn node(&self, k: usize) -> (usize, f64) {
        let surface = self.first.partition_point(|&f| f <= k) - 1;
        let (panel, i) = ((k - self.first[surface]) / self.order, (k - self.first[surface]) % self.order);
        let ends = &self.panels[surface];
        (surface, ends[panel] + (ends[panel + 1] - ends[panel]) * self.nodes[i])
    }

    /// Lagrange's weights of the panel at a parameter, and the panel's first node.
    fn weights(&self, surface: usize, t: f64) -> (usize, Vec<f64>) {
        let ends = &self.panels[surface];
        let panel = (ends.partition_point(|&e| e <= t).max(1) - 1).min(ends.len() - 2);
        let x = (t - ends[panel]) / (ends[panel + 1] - ends[panel]);
        let weight = |i: usize| {
            let others = (0..self.order).filter(|&j| j != i);
            others.map(|j| (x - self.nodes[j]) / (self.nodes[i] - self.nodes[j])).product()
        };
        (self.first[surface] + panel * self.order, (0..self.order).map(weight).collect())
    }

    fn row(&self, k: usize, jumps: &[V], r: Resolution, row: &mut [f64], direct: &mut [f64]) {
        let (surface, t) = self.node(k);
        if self.scene.surfaces[surface].diffuse == 0.0 {
            return;
        }
        let (x, n) = self.scene.surfaces[surface].place(t);
        let count = row.len() / direct.len();
        let most = self.bounces.map_or(usize::MAX, |b| b - 1);
        let class = |depth: usize| self.bounces.map_or(0, |_| depth);
        let rule = graded(r.points);
        let cuts = cuts(self.scene, x, n, surface, r.probes, jumps);
        for w in cuts.windows(2).filter(|w| w[1] > w[0]) {
            // in the sine, whose differential is the cosine that weighs
            let (a, b) = (w[0].sin(), w[1].sin());
            for (u, weight) in &rule {
                let s = a + (b - a) * u;
                let weight = 0.5 * (b - a) * weight;
                let d = at_angle(n, s.asin());
                let (met, escape) = chain(self.scene, x, d, surface, most);
                for m in met {
                    let (first, weights) = self.weights(m.surface, m.parameter);
                    for (i, lagrange) in weights.iter().enumerate() {
                        row[class(m.depth) * count + first + i] += weight * m.through * lagrange;
                    }
                }
                if let Some((d, through, depth)) = escape
                    && depth <= most
                {
                    direct[class(depth)] += weight * through * (self.sky)(d);
                }
            }
        }
    }

    fn solve(&mut self, matrix: &[Vec<f64>], direct: &[Vec<f64>], classes: usize) {
        let count = matrix.len();
        let diffuse: Vec<f64> = (0..count).map(|k| self.scene.surfaces[self.node(k).0].diffuse).collect();
        let times = |row: &[f64], x: &[f64]| row.iter().zip(x).map(|(a, b)| a * b).sum::<f64>();
        match self.bounces {
            Some(most) => {
                for b in 1..=most {
                    let level = (0..count).map(|k| {
                        let mut sum: f64 = direct[k][..b.min(classes)].iter().sum();
                        for class in 0..b - 1 {
                            sum += times(&matrix[k][class * count..][..count], &self.levels[b - 2 - class]);
                        }
                        diffuse[k] * sum
                    });
                    let level = level.collect();
                    self.levels.push(level);
                }
            }
            None => {
                let mut x = vec![0.0; count];
                loop {
                    let sweep = |k: usize| diffuse[k] * (direct[k][0] + times(&matrix[k], &x));
                    let next: Vec<f64> = (0..count).map(sweep).collect();
                    let change = next.iter().zip(&x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                    x = next;
                    if change < 1e-13 {
                        break;
                    }
                }
                self.levels.push(x);
            }
        }
    }

    /// Diffuse radiance at a parameter of a surface, on a level.
    pub fn diffuse(&self, surface: usize, t: f64, level: usize) -> f64 {
        let (first, weights) = self.weights(surface, t);
        weights.iter().enumerate().map(|(i, w)| w * self.levels[level][first + i]).sum()
    }

    /// Radiance against `d` at `o`, or `None` where the object is missed.
    pub fn radiance(&self, o: V, d: V) -> Option<f64> {
        let (met, escape) = chain(self.scene, o, d, usize::MAX, self.bounces.unwrap_or(usize::MAX));
        let mut sum = 0.0;
        for m in &met {
            let level = match self.bounces {
                Some(most) if m.depth >= most => continue,
                Some(most) => most - m.depth - 1,
                None => 0,
            };
            sum += m.through * self.diffuse(m.surface, m.parameter, level);
        }
        if let Some((d, through, _)) = escape {
            sum += through * (self.sky)(d);
        }
        self.scene.first(o, d, usize::MAX).map(|_| sum)
    }

    /// A view's samples.
    pub fn image(&self, g: f64, m: usize) -> Vec<Option<f64>> {
        self.scene.view(g, m).into_iter().map(|(o, d)| self.radiance(o, d)).collect()
    }
}

/// Ends of `n` panels: equal on circles, halving toward the ends of segments (corners) and equal between.
fn ends(shape: &Shape, n: usize) -> Vec<f64> {
    let equal = |n: usize| (0..=n).map(|i| i as f64 / n as f64).collect::<Vec<_>>();
    if let Shape::Circle { .. } = shape {
        return equal(n);
    }
    let mut all = equal(n);
    let h = all[1];
    for i in 1..=8 {
        let t = h * 0.5f64.powi(i);
        all.extend([t, 1.0 - t]);
    }
    all.sort_by(f64::total_cmp);
    all
}

/// Point, normal and surface of a ray's first hit.
pub fn hit_of(scene: &Scene, (o, d): (V, V)) -> Option<(V, V, usize)> {
    scene.first(o, d, usize::MAX).map(|h| (h.point, h.normal, h.surface))
}

/// Whether the mirror chain of a ray's first hit, or its diffuse light, meets the object again.
pub fn coupled(scene: &Scene, ray: (V, V)) -> bool {
    hit_of(scene, ray).is_some_and(|(x, n, s)| {
        let surface = &scene.surfaces[s];
        if surface.diffuse > 0.0 || surface.lobe.is_some() {
            return scene.coupled(x, n, s);
        }
        scene.first(x, reflect(ray.1, n), s).is_some()
    })
}

//! Satellites made of quads, and the processor's clock.

/// A mesh that grows by rectangles of quads, each of two facets.
#[derive(Default)]
pub struct Mesh {
    /// Corners.
    pub vertices: Vec<[f64; 3]>,
    /// Corners of each facet.
    pub facets: Vec<[u32; 3]>,
    /// Material of each facet.
    pub materials: Vec<u32>,
}

impl Mesh {
    /// A rectangle from `origin` along the axes `first` and `second`; its front is on their right-handed side.
    pub fn rectangle(
        &mut self,
        origin: [f64; 3],
        (first, length, columns): (usize, f64, u32),
        (second, width, rows): (usize, f64, u32),
        material: u32,
    ) {
        let start = self.vertices.len() as u32;
        for row in 0..=rows {
            for column in 0..=columns {
                let mut vertex = origin;
                vertex[first] += length * f64::from(column) / f64::from(columns);
                vertex[second] += width * f64::from(row) / f64::from(rows);
                self.vertices.push(vertex);
            }
        }
        for row in 0..rows {
            for column in 0..columns {
                let [a, b] = [row, row + 1].map(|row| start + row * (columns + 1) + column);
                self.facets.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
                self.materials.extend([material; 2]);
            }
        }
    }

    /// A box between two corners, fronts outward; `top` is the material of its upper side.
    pub fn cuboid(&mut self, low: [f64; 3], high: [f64; 3], quads: [u32; 3], top: u32) {
        for axis in 0..3 {
            let [first, second] = [(axis + 1) % 3, (axis + 2) % 3];
            let edge = |axis: usize| (axis, high[axis] - low[axis], quads[axis]);
            let mut upper = low;
            upper[axis] = high[axis];
            self.rectangle(upper, edge(first), edge(second), if axis == 2 { top } else { 0 });
            self.rectangle(low, edge(second), edge(first), 0);
        }
    }
}

/// Processor seconds of the process so far, to a hundredth.
pub fn processor_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let times = text.rsplit(')').next().unwrap_or("").split_whitespace().skip(11).take(2);
    times.filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

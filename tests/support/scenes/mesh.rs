//! An indexed triangle mesh with the operations of the tests: building, transforms, subdivision, permutation.

use glam::{DQuat, DVec3};
use std::collections::HashMap;
use std::path::Path;

/// Triangles over shared vertices; front = counter-clockwise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Positions, any unit.
    pub vertices: Vec<[f64; 3]>,
    /// Three vertex indices per facet.
    pub facets: Vec<[u32; 3]>,
    /// Material index per facet.
    pub materials: Vec<u32>,
}

impl Mesh {
    /// Appends the parallelogram of corner `origin` and sides `a`, `b` as n x n quads (a outer, b inner), each the
    /// triangles (00, 10, 11) and (00, 11, 01). Front along a x b.
    pub fn rectangle(&mut self, origin: DVec3, a: DVec3, b: DVec3, n: usize, material: u32) {
        let base = self.vertices.len() as u32;
        let stride = n as u32 + 1;
        for i in 0..=n {
            for j in 0..=n {
                let p = origin + a * (i as f64 / n as f64) + b * (j as f64 / n as f64);
                self.vertices.push(p.to_array());
            }
        }
        for i in 0..n as u32 {
            for j in 0..n as u32 {
                let v = base + i * stride + j;
                self.facets.push([v, v + stride, v + stride + 1]);
                self.facets.push([v, v + stride + 1, v + 1]);
                self.materials.extend([material; 2]);
            }
        }
    }

    /// Appends another mesh, its material indices kept.
    pub fn joined(mut self, other: &Mesh) -> Mesh {
        let base = self.vertices.len() as u32;
        self.vertices.extend(&other.vertices);
        self.facets.extend(other.facets.iter().map(|f| f.map(|v| v + base)));
        self.materials.extend(&other.materials);
        self
    }

    /// Merges vertices of equal coordinates, so that neighbours share them.
    pub fn welded(&self) -> Mesh {
        let mut seen = HashMap::new();
        let mut vertices = Vec::new();
        let index: Vec<u32> = self
            .vertices
            .iter()
            .map(|v| {
                // adding 0 makes -0 and 0 one key
                *seen.entry(v.map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
                    vertices.push(*v);
                    vertices.len() as u32 - 1
                })
            })
            .collect();
        let facets = self.facets.iter().map(|f| f.map(|v| index[v as usize])).collect();
        Mesh { vertices, facets, materials: self.materials.clone() }
    }

    /// The same surface with fronts and backs exchanged.
    pub fn flipped(&self) -> Mesh {
        let facets = self.facets.iter().map(|&[a, b, c]| [a, c, b]).collect();
        Mesh { facets, ..self.clone() }
    }

    /// The same mesh with one material index per facet.
    pub fn with_materials(&self, materials: &[u32]) -> Mesh {
        assert_eq!(materials.len(), self.facets.len());
        Mesh { materials: materials.to_vec(), ..self.clone() }
    }

    /// The same mesh with one material for all.
    pub fn of_material(&self, material: u32) -> Mesh {
        Mesh { materials: vec![material; self.facets.len()], ..self.clone() }
    }

    /// Every facet cut into 4 at its edges' midpoints, `levels` times; the children of facet f are 4 f to 4 f + 3.
    pub fn subdivided(&self, levels: u32) -> Mesh {
        let mut mesh = self.clone();
        for _ in 0..levels {
            let mut middles = HashMap::new();
            let mut facets = Vec::with_capacity(4 * mesh.facets.len());
            for &[a, b, c] in &mesh.facets {
                let mut middle = |p: u32, q: u32| {
                    *middles.entry((p.min(q), p.max(q))).or_insert_with(|| {
                        let sum =
                            DVec3::from(mesh.vertices[p as usize]) + DVec3::from(mesh.vertices[q as usize]);
                        mesh.vertices.push((sum * 0.5).to_array());
                        mesh.vertices.len() as u32 - 1
                    })
                };
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                facets.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
            }
            mesh.materials = mesh.materials.iter().flat_map(|&m| [m; 4]).collect();
            mesh.facets = facets;
        }
        mesh
    }

    /// Every vertex mapped.
    pub fn mapped(&self, f: impl Fn(DVec3) -> DVec3) -> Mesh {
        Mesh { vertices: self.vertices.iter().map(|&v| f(v.into()).to_array()).collect(), ..self.clone() }
    }

    /// Rotated about an axis through the origin by `angle` radians, counter-clockwise seen from the axis' tip.
    pub fn rotated(&self, axis: [f64; 3], angle: f64) -> Mesh {
        let rotation = DQuat::from_axis_angle(DVec3::from(axis).normalize(), angle);
        self.mapped(|v| rotation * v)
    }

    /// Moved by `offset`.
    pub fn translated(&self, offset: [f64; 3]) -> Mesh {
        self.mapped(|v| v + DVec3::from(offset))
    }

    /// Scaled about the origin; a positive factor.
    pub fn scaled(&self, factor: f64) -> Mesh {
        self.mapped(|v| v * factor)
    }

    /// The facets in another order: new facet i is the old facet `order[i]`.
    pub fn permuted(&self, order: &[usize]) -> Mesh {
        Mesh {
            vertices: self.vertices.clone(),
            facets: order.iter().map(|&i| self.facets[i]).collect(),
            materials: order.iter().map(|&i| self.materials[i]).collect(),
        }
    }

    /// Corner positions of a facet.
    pub fn corners(&self, facet: usize) -> [DVec3; 3] {
        self.facets[facet].map(|v| DVec3::from(self.vertices[v as usize]))
    }

    /// Area of a facet, in the unit of the vertices squared.
    pub fn area(&self, facet: usize) -> f64 {
        let [a, b, c] = self.corners(facet);
        (b - a).cross(c - a).length() / 2.0
    }

    /// The volume that a closed mesh encloses, positive with fronts outward.
    pub fn volume(&self) -> f64 {
        let tetrahedron = |f| {
            let [a, b, c] = self.corners(f);
            a.dot(b.cross(c)) / 6.0
        };
        (0..self.facets.len()).map(tetrahedron).sum()
    }

    /// Whether every edge is shared by exactly two facets that run along it in opposite directions.
    pub fn is_watertight(&self) -> bool {
        let mut edges = HashMap::new();
        for &[a, b, c] in &self.facets {
            for edge in [(a, b), (b, c), (c, a)] {
                *edges.entry(edge).or_insert(0) += 1;
            }
        }
        edges.iter().all(|(&(a, b), &count)| count == 1 && edges.get(&(b, a)) == Some(&1))
    }
}

/// Reads the lines `v`, `f` and `usemtl` of an OBJ file of triangles with positive indices; the material names in the
/// order of their first use. Panics on anything it does not understand there: it is for the tests' own meshes.
pub fn read_obj(path: &Path) -> (Mesh, Vec<String>) {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let (mut mesh, mut names) = (Mesh::default(), Vec::<String>::new());
    let mut material = None;
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let v: Vec<f64> = words.map(|w| w.parse().expect(line)).collect();
                mesh.vertices.push([v[0], v[1], v[2]]);
            }
            Some("usemtl") => {
                let name = words.next().expect(line).to_string();
                let known = names.iter().position(|n| *n == name);
                material = known.or_else(|| {
                    names.push(name);
                    Some(names.len() - 1)
                });
            }
            Some("f") => {
                let corner = |w: &str| w.split('/').next().unwrap_or(w).parse::<u32>().expect(line) - 1;
                let f: Vec<u32> = words.map(corner).collect();
                mesh.facets.push(f.try_into().expect("triangles only"));
                if material.is_none() {
                    names.push("default".to_string());
                    material = Some(0);
                }
                mesh.materials.push(material.unwrap_or(0) as u32);
            }
            _ => {}
        }
    }
    (mesh, names)
}

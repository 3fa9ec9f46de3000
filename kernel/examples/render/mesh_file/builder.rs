//! Collects a file's vertices and polygons, checks them and makes triangles of them.

use std::collections::HashMap;
use std::fmt::Display;
use std::path::Path;

use super::polygon::{self, Triangle};
use super::{Mesh, NO_NORMAL};
use crate::failure::{Failure, Outcome};

/// One corner of a polygon. Indices are checked only at the end: a file may name vertices before it lists them.
#[derive(Clone, Copy)]
pub struct Corner {
    /// Index of the vertex, from 0.
    pub vertex: i64,
    /// Index of the vertex normal, from 0.
    pub normal: Option<i64>,
}

/// How messages say where something stands.
#[derive(Clone, Copy)]
pub enum Place {
    /// Line of a text file, from 1.
    Line(usize),
    /// Running number in the file, from 0.
    Item(usize),
}

struct Polygon {
    corners: std::ops::Range<usize>,
    material: u32,
    place: Place,
}

/// A mesh being read.
pub struct Builder<'a> {
    path: &'a Path,
    /// What indices in messages start from, as the format counts.
    first_index: i64,
    mesh: Mesh,
    materials: HashMap<String, u32>,
    corners: Vec<Corner>,
    polygons: Vec<Polygon>,
}

impl<'a> Builder<'a> {
    /// An empty mesh of the file at `path`, whose format counts vertices from `first_index`.
    pub fn new(path: &'a Path, first_index: i64) -> Self {
        let mesh = Mesh::default();
        Builder {
            path,
            first_index,
            mesh,
            materials: HashMap::new(),
            corners: Vec::new(),
            polygons: Vec::new(),
        }
    }

    /// Number of vertices so far.
    pub fn vertices(&self) -> usize {
        self.mesh.vertices.len()
    }

    /// Number of vertex normals so far.
    pub fn normals(&self) -> usize {
        self.mesh.normals.len()
    }

    /// Adds a vertex.
    pub fn vertex(&mut self, place: Place, position: [f64; 3]) -> Outcome<()> {
        self.mesh.vertices.push(self.finite(place, "vertex", position)?);
        Ok(())
    }

    /// Adds a vertex normal.
    pub fn normal(&mut self, place: Place, normal: [f64; 3]) -> Outcome<()> {
        self.mesh.normals.push(self.finite(place, "vertex normal", normal)?);
        Ok(())
    }

    /// The index of the material called `name`.
    pub fn material(&mut self, name: &str) -> u32 {
        if let Some(index) = self.materials.get(name) {
            return *index;
        }
        let index = self.mesh.material_names.len() as u32;
        self.mesh.material_names.push(name.to_owned());
        self.materials.insert(name.to_owned(), index);
        index
    }

    /// Adds a polygon.
    pub fn polygon(
        &mut self,
        place: Place,
        corners: impl IntoIterator<Item = Corner>,
        material: u32,
    ) -> Outcome<()> {
        let start = self.corners.len();
        self.corners.extend(corners);
        let corners = start..self.corners.len();
        if corners.len() < 3 {
            let what = format!("expected a face of at least 3 corners, got {}", corners.len());
            return Err(self.fail(place, "face", what));
        }
        self.polygons.push(Polygon { corners, material, place });
        Ok(())
    }

    /// Checks all indices and makes the triangles.
    pub fn finish(mut self) -> Outcome<Mesh> {
        if self.polygons.is_empty() {
            return Err(Failure::at(self.path, "the mesh is empty: expected at least one facet"));
        }
        if self.mesh.vertices.len() >= u32::MAX as usize || self.mesh.normals.len() >= u32::MAX as usize {
            return Err(Failure::at(self.path, "too many vertices: expected fewer than 2^32 - 1"));
        }
        let mut points = Vec::new();
        let mut triangles = Vec::new();
        for polygon in std::mem::take(&mut self.polygons) {
            let corners = self.checked(&polygon)?;
            points.clear();
            points.extend(corners.iter().map(|corner| self.mesh.vertices[corner[0] as usize]));
            triangles.clear();
            polygon::triangulate(&points, &mut triangles);
            for Triangle(triangle) in &triangles {
                self.mesh.facets.push(triangle.map(|i| corners[i][0]));
                self.mesh.facet_normals.push(triangle.map(|i| corners[i][1]));
                self.mesh.facet_materials.push(polygon.material);
            }
        }
        if self.mesh.facets.len() >= u32::MAX as usize {
            return Err(Failure::at(self.path, "too many facets: expected fewer than 2^32 - 1"));
        }
        Ok(self.mesh)
    }

    /// Vertex and normal index of every corner, in range.
    fn checked(&self, polygon: &Polygon) -> Outcome<Vec<[u32; 2]>> {
        let index = |what: &str, index: i64, count: usize| {
            usize::try_from(index).ok().filter(|i| *i < count).map(|i| i as u32).ok_or_else(|| {
                let (got, first) = (index.saturating_add(self.first_index), self.first_index);
                let last = count as i64 - 1 + first;
                let range =
                    if count == 0 { "none is given".into() } else { format!("expected {first} to {last}") };
                self.fail(polygon.place, "face", format_args!("{what} index {got} is out of range: {range}"))
            })
        };
        self.corners[polygon.corners.clone()]
            .iter()
            .map(|corner| {
                let vertex = index("vertex", corner.vertex, self.mesh.vertices.len())?;
                let normal = match corner.normal {
                    None => NO_NORMAL,
                    Some(normal) => index("normal", normal, self.mesh.normals.len())?,
                };
                Ok([vertex, normal])
            })
            .collect()
    }

    fn finite(&self, place: Place, item: &str, v: [f64; 3]) -> Outcome<[f64; 3]> {
        if v.iter().all(|x| x.is_finite()) {
            Ok(v)
        } else {
            Err(self.fail(
                place,
                item,
                format_args!("{item} {v:?} is not finite: expected three finite numbers"),
            ))
        }
    }

    fn fail(&self, place: Place, item: &str, what: impl Display) -> Failure {
        match place {
            Place::Line(line) => Failure::at_line(self.path, line, what),
            Place::Item(index) => Failure::at(self.path, format_args!("{item} {index}: {what}")),
        }
    }
}

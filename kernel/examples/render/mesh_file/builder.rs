//! Collects a file's vertices and polygons, checks them and makes triangles of them.

use std::collections::{BTreeMap, HashMap};
use std::fmt::Display;
use std::path::Path;

use super::polygon::{self, Shape, Triangle};
use super::{Finish, Mesh, NO_NORMAL};
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
    /// Vertices that are not finite: an error where a facet has one.
    bad_vertices: BTreeMap<u32, Failure>,
    /// Vertex normals without a direction: of no matter as long as none are asked for.
    bad_normals: BTreeMap<u32, Failure>,
}

impl<'a> Builder<'a> {
    /// An empty mesh of the file at `path`, whose format counts vertices from `first_index`.
    pub fn new(path: &'a Path, first_index: i64) -> Self {
        Builder {
            path,
            first_index,
            mesh: Mesh::default(),
            materials: HashMap::new(),
            corners: Vec::new(),
            polygons: Vec::new(),
            bad_vertices: BTreeMap::new(),
            bad_normals: BTreeMap::new(),
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

    /// Adds a vertex of an item at `place`.
    pub fn vertex(&mut self, place: Place, item: &str, position: [f64; 3]) {
        if !position.iter().all(|x| x.is_finite()) {
            let what = format!("vertex {position:?} is not finite: expected three finite numbers");
            self.bad_vertices.insert(self.vertices() as u32, self.fail(place, item, what));
        }
        self.mesh.vertices.push(position);
    }

    /// Adds a vertex normal.
    pub fn normal(&mut self, place: Place, normal: [f64; 3]) {
        if !normal.iter().all(|x| x.is_finite()) || normal == [0.0; 3] {
            let what =
                format!("vertex normal {normal:?}: expected a direction, three finite numbers, not all 0");
            self.bad_normals.insert(self.normals() as u32, self.fail(place, "vertex normal", what));
        }
        self.mesh.normals.push(normal);
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

    /// Says that facets of this material are seen from both sides, as the file has it.
    pub fn double_sided(&mut self, material: u32) {
        if !self.mesh.double_sided.contains(&material) {
            self.mesh.double_sided.push(material);
        }
    }

    /// Notes how the file says that a material looks.
    pub fn finish_of(&mut self, material: &str, finish: Finish) {
        self.mesh.finishes.insert(material.to_owned(), finish);
    }

    /// Names a file of material properties.
    pub fn library(&mut self, name: &str) {
        self.mesh.libraries.push(name.to_owned());
    }

    /// Adds a polygon; one of fewer than three corners is passed over with a warning.
    pub fn polygon(&mut self, place: Place, corners: impl IntoIterator<Item = Corner>, material: u32) {
        let start = self.corners.len();
        self.corners.extend(corners);
        let corners = start..self.corners.len();
        if corners.len() < 3 {
            let what = format!("expected a face of at least 3 corners, got {}: passed over", corners.len());
            self.warn("few corners", place, "face", what);
            self.corners.truncate(start);
            return;
        }
        self.polygons.push(Polygon { corners, material, place });
    }

    /// Warns of `what`; a kind that occurs again is counted.
    pub fn warn(&mut self, kind: &'static str, place: Place, item: &str, what: impl Display) {
        let failure = self.fail(place, item, what);
        self.mesh.warnings.add(kind, || failure);
    }

    /// Warns of something that has no one place.
    pub fn warn_of_file(&mut self, kind: &'static str, what: impl Display) {
        self.mesh.warnings.add(kind, || Failure::at(self.path, what));
    }

    /// Says why the file's normals cannot be used.
    pub fn normal_fault(&mut self, place: Place, item: &str, what: impl Display) {
        let failure = self.fail(place, item, what);
        self.mesh.normal_fault.get_or_insert(failure);
    }

    /// Checks all indices and makes the triangles.
    pub fn finish(mut self) -> Outcome<Mesh> {
        if self.polygons.is_empty() {
            let passed: Vec<String> = self.mesh.warnings.lines().collect();
            let why = if passed.is_empty() {
                format!("no facet among {} vertices", self.vertices())
            } else {
                format!("no facet is left: {}", passed.join("; "))
            };
            return Err(Failure::at(
                self.path,
                format_args!("the mesh is empty ({why}): expected at least one facet"),
            ));
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
            if polygon::triangulate(&points, &mut triangles) == Shape::Crossing {
                let what = "the polygon crosses itself: some of its triangles overlap";
                self.warn("crossing polygon", polygon.place, "face", what);
            }
            for Triangle(triangle) in &triangles {
                self.mesh.facets.push(triangle.map(|i| corners[i][0]));
                self.mesh.facet_normals.push(triangle.map(|i| corners[i][1]));
                self.mesh.facet_materials.push(polygon.material);
            }
        }
        if self.mesh.facets.len() >= u32::MAX as usize {
            return Err(Failure::at(self.path, "too many facets: expected fewer than 2^32 - 1"));
        }
        self.replace_unused();
        Ok(self.mesh)
    }

    /// Vertices that no facet has may be anything.
    fn replace_unused(&mut self) {
        for (index, failure) in std::mem::take(&mut self.bad_vertices) {
            self.mesh.vertices[index as usize] = [0.0; 3];
            self.mesh
                .warnings
                .add("bad vertex", || Failure::new(format_args!("{failure} (no facet has it)")));
        }
        for index in self.bad_normals.keys() {
            self.mesh.normals[*index as usize] = [0.0, 0.0, 1.0];
        }
    }

    /// Vertex and normal index of every corner, in range.
    fn checked(&mut self, polygon: &Polygon) -> Outcome<Vec<[u32; 2]>> {
        let mut checked = Vec::with_capacity(polygon.corners.len());
        for corner in &self.corners[polygon.corners.clone()] {
            let vertex = self.index(polygon, "vertex", corner.vertex, self.mesh.vertices.len())?;
            if let Some(failure) = self.bad_vertices.get(&vertex) {
                return Err(failure.clone());
            }
            let normal = corner.normal.map(|n| self.index(polygon, "normal", n, self.mesh.normals.len()));
            let normal = match normal {
                None => NO_NORMAL,
                Some(Ok(normal)) => match self.bad_normals.get(&normal) {
                    None => normal,
                    Some(failure) => {
                        self.mesh.normal_fault.get_or_insert_with(|| failure.clone());
                        NO_NORMAL
                    }
                },
                Some(Err(failure)) => {
                    self.mesh.normal_fault.get_or_insert(failure);
                    NO_NORMAL
                }
            };
            checked.push([vertex, normal]);
        }
        Ok(checked)
    }

    fn index(&self, polygon: &Polygon, what: &str, index: i64, count: usize) -> Outcome<u32> {
        let found = usize::try_from(index).ok().filter(|i| *i < count).map(|i| i as u32);
        found.ok_or_else(|| {
            let (got, first) = (index.saturating_add(self.first_index), self.first_index);
            let last = count as i64 - 1 + first;
            let range =
                if count == 0 { "none is given".into() } else { format!("expected {first} to {last}") };
            self.fail(polygon.place, "face", format_args!("{what} index {got} is out of range: {range}"))
        })
    }

    /// The failure of an item of the file.
    pub fn fail(&self, place: Place, item: &str, what: impl Display) -> Failure {
        match place {
            Place::Line(line) => Failure::at_line(self.path, line, what),
            Place::Item(index) => Failure::at(self.path, format_args!("{item} {index}: {what}")),
        }
    }
}

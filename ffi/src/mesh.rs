//! The caller's mesh as the kernel reads it: strided arrays, without a copy.

use crate::status::*;
use crate::types::*;
use blik_kernel::scene::{Gloss, MAX_BANDS, MaterialInput, Mesh};
use core::slice::from_raw_parts;

static ZEROS: [f64; MAX_BANDS] = [0.0; MAX_BANDS];

/// A checked [`blik_mesh`]: no pointer is null where it is read, every stride holds its entries.
pub(crate) struct Reader(blik_mesh);

/// Checks an array, the field `field`, of `numbers` numbers an entry in one of `formats`.
fn check(array: &mut blik_array, field: i32, numbers: usize, formats: &[i32]) -> Result<(), blik_error> {
    if array.count == 0 {
        return Ok(());
    }
    let refused = |status| blik_error::of(status).field(field);
    if !formats.contains(&array.format) {
        return Err(refused(BLIK_ERROR_CHOICE).at(0, 0, f64::from(array.format)));
    }
    if array.data.is_null() {
        return Err(refused(BLIK_ERROR_NULL));
    }
    let size = match array.format {
        BLIK_F64 | BLIK_U64 => 8,
        BLIK_U8 => 1,
        BLIK_U16 => 2,
        _ => 4,
    };
    if array.stride == 0 {
        array.stride = numbers * size;
    }
    if array.stride < numbers * size {
        return Err(refused(BLIK_ERROR_LENGTH).sizes(numbers * size, array.stride));
    }
    fits(array.stride, array.count, field)
}

/// Refuses more entries than memory can hold.
fn fits(stride: usize, count: usize, field: i32) -> Result<(), blik_error> {
    match stride.checked_mul(count) {
        Some(bytes) if bytes <= isize::MAX as usize => Ok(()),
        _ => Err(blik_error::of(BLIK_ERROR_TOO_MANY).field(field).sizes(isize::MAX as usize, count)),
    }
}

impl Reader {
    /// # Safety
    /// As for [`read`]; the arrays are as long as the struct says.
    pub unsafe fn new(mesh: *const blik_mesh) -> Result<Reader, blik_error> {
        // SAFETY: by the caller's promise.
        let mut mesh = unsafe { read(mesh) }?;
        let reals = [BLIK_F64, BLIK_F32];
        check(&mut mesh.vertices, BLIK_FIELD_VERTICES, 3, &reals)?;
        let integers = [BLIK_U32, BLIK_U16, BLIK_U8, BLIK_U64];
        check(&mut mesh.facets, BLIK_FIELD_FACETS, 3, &integers)?;
        check(&mut mesh.facet_materials, BLIK_FIELD_FACET_MATERIALS, 1, &integers)?;
        check(&mut mesh.normals, BLIK_FIELD_NORMALS, 3, &reals)?;
        check(&mut mesh.facet_normals, BLIK_FIELD_FACET_NORMALS, 3, &[BLIK_U32, BLIK_U64])?;
        let materials = |status| blik_error::of(status).field(BLIK_FIELD_MATERIALS);
        if mesh.material_count > 0 && mesh.materials.is_null() {
            return Err(materials(BLIK_ERROR_NULL));
        }
        let size = size_of::<blik_material>();
        if mesh.material_stride < size {
            return Err(materials(BLIK_ERROR_STRUCT_SIZE).sizes(size, mesh.material_stride));
        }
        fits(mesh.material_stride, mesh.material_count, BLIK_FIELD_MATERIALS)?;
        let mesh = Reader(mesh);
        for index in 0..mesh.0.material_count {
            let material = mesh.raw(index);
            if ![material.diffuse, material.specular, material.emission].iter().all(|p| p.is_aligned()) {
                return Err(blik_error { index, ..materials(BLIK_ERROR_ALIGNMENT) });
            }
        }
        Ok(mesh)
    }

    /// A material as the caller keeps it.
    fn raw(&self, index: usize) -> blik_material {
        let at = self.0.materials.cast::<u8>().wrapping_add(index * self.0.material_stride);
        // SAFETY: indices are below `material_count`, and the stride holds a material.
        unsafe { at.cast::<blik_material>().read_unaligned() }
    }

    /// Number `at` of entry `index`.
    fn number<T: Copy>(array: &blik_array, index: usize, at: usize) -> T {
        let entry = array.data.cast::<u8>().wrapping_add(index.wrapping_mul(array.stride));
        // SAFETY: the kernel asks for indices below `count`, and `check` saw that an entry holds as many numbers.
        unsafe { entry.cast::<T>().add(at).read_unaligned() }
    }

    fn reals(array: &blik_array, index: usize) -> [f64; 3] {
        if array.format == BLIK_F64 {
            [0, 1, 2].map(|k| Reader::number::<f64>(array, index, k))
        } else {
            [0, 1, 2].map(|k| f64::from(Reader::number::<f32>(array, index, k)))
        }
    }

    fn integer(array: &blik_array, index: usize, at: usize) -> u32 {
        match array.format {
            BLIK_U8 => u32::from(Reader::number::<u8>(array, index, at)),
            BLIK_U16 => u32::from(Reader::number::<u16>(array, index, at)),
            BLIK_U64 => match Reader::number::<u64>(array, index, at) {
                u64::MAX => BLIK_NO_NORMAL,
                // more than there may be of anything: refused by the kernel
                number => u32::try_from(number).unwrap_or(BLIK_NO_NORMAL - 1),
            },
            _ => Reader::number(array, index, at),
        }
    }
}

impl Mesh for Reader {
    fn vertices(&self) -> usize {
        self.0.vertices.count
    }

    fn vertex(&self, index: usize) -> [f64; 3] {
        Reader::reals(&self.0.vertices, index)
    }

    fn facets(&self) -> usize {
        self.0.facets.count
    }

    fn facet(&self, index: usize) -> [u32; 3] {
        [0, 1, 2].map(|k| Reader::integer(&self.0.facets, index, k))
    }

    fn facet_materials(&self) -> usize {
        self.0.facet_materials.count
    }

    fn facet_material(&self, facet: usize) -> u32 {
        Reader::integer(&self.0.facet_materials, facet, 0)
    }

    fn normals(&self) -> usize {
        self.0.normals.count
    }

    fn normal(&self, index: usize) -> [f64; 3] {
        Reader::reals(&self.0.normals, index)
    }

    fn facet_normals(&self) -> usize {
        self.0.facet_normals.count
    }

    fn facet_normal(&self, facet: usize) -> [u32; 3] {
        [0, 1, 2].map(|k| Reader::integer(&self.0.facet_normals, facet, k))
    }

    fn materials(&self) -> usize {
        self.0.material_count
    }

    fn material(&self, index: usize) -> MaterialInput<'_> {
        let material = self.raw(index);
        let bands = self.0.bands.min(MAX_BANDS);
        let values = |at: *const f64| {
            if at.is_null() {
                return ZEROS.get(..bands).unwrap_or(&ZEROS);
            }
            // SAFETY: by the caller's promise one value per band, for as long as the mesh is read.
            unsafe { from_raw_parts(at, bands) }
        };
        let rays = Some(material.gloss_rays).filter(|n| *n > 0);
        let axis_ratio = material.gloss_axis_ratio;
        MaterialInput {
            diffuse: values(material.diffuse),
            specular: values(material.specular),
            emission: values(material.emission),
            gloss: (axis_ratio != 0.0).then_some(Gloss { axis_ratio, rays }),
        }
    }

    fn two_sided(&self) -> bool {
        self.0.two_sided != 0
    }

    fn bands(&self) -> usize {
        self.0.bands
    }
}

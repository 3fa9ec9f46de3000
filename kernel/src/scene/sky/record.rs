//! A sky's input as a record of numbers, beside its arrays: the form in which baked blocks keep skies and C callers
//! give them.

use super::{SkyInput, SkyModel, SkyTable};
use crate::base::arena::plain_struct;

plain_struct! {
    /// A sky without its arrays.
    pub struct SkyRecord {
        /// 0: none; else 1 + the model's place in [`SkyModel`].
        pub model: u64,
        /// Type of a CIE sky.
        pub cie_type: u64,
        /// Toward the zenith.
        pub up: [f64; 3],
        /// Sun of a CIE sky, or azimuth 0 of a table (zeros: by default).
        pub direction: [f64; 3],
        /// Rows, columns and bands of a table.
        pub table: [u64; 3],
    }
}

/// [`SkyRecord::model`] of a table.
const TABLE: u64 = 6;

impl SkyRecord {
    /// The record of a sky.
    pub fn new(sky: &SkyInput<'_>) -> SkyRecord {
        let none = SkyRecord { up: sky.up, ..SkyRecord::default() };
        match sky.model {
            SkyModel::Uniform => SkyRecord { model: 1, ..none },
            SkyModel::Hemisphere => SkyRecord { model: 2, ..none },
            SkyModel::Overcast => SkyRecord { model: 3, ..none },
            SkyModel::Cie { kind, sun_direction } => {
                SkyRecord { model: 4, cie_type: u64::from(kind), direction: sun_direction, ..none }
            }
            SkyModel::Gradient => SkyRecord { model: 5, ..none },
            SkyModel::Table(SkyTable { rows, columns, bands, azimuth_zero, .. }) => SkyRecord {
                model: TABLE,
                direction: azimuth_zero.unwrap_or_default(),
                table: [rows, columns, bands].map(|n| n as u64),
                ..none
            },
        }
    }

    /// Samples of the sky's table; `None` where memory has no room for as many.
    pub fn samples(&self) -> Option<usize> {
        if self.model != TABLE {
            return Some(0);
        }
        self.table.iter().try_fold(1usize, |count, &n| count.checked_mul(usize::try_from(n).ok()?))
    }

    /// The sky of this record and its arrays; `None` for a model that there is not.
    pub fn input<'a>(
        &self,
        radiance: &'a [f64],
        ground: &'a [f64],
        samples: &'a [f32],
    ) -> Option<SkyInput<'a>> {
        let [rows, columns, bands] = self.table.map(|n| usize::try_from(n).unwrap_or(usize::MAX));
        let model = match self.model {
            1 => SkyModel::Uniform,
            2 => SkyModel::Hemisphere,
            3 => SkyModel::Overcast,
            4 => SkyModel::Cie { kind: u32::try_from(self.cie_type).ok()?, sun_direction: self.direction },
            5 => SkyModel::Gradient,
            TABLE => SkyModel::Table(SkyTable {
                rows,
                columns,
                bands,
                radiance: samples,
                azimuth_zero: (self.direction != [0.0; 3]).then_some(self.direction),
            }),
            _ => return None,
        };
        Some(SkyInput { model, radiance, ground, up: self.up })
    }
}

impl<'a> SkyModel<'a> {
    /// Samples of its table; none where it has none.
    pub fn samples(&self) -> &'a [f32] {
        match self {
            SkyModel::Table(table) => table.radiance,
            _ => &[],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_model_comes_back() {
        let samples = [0.5, 0.25, 1.0, 2.0];
        let table = SkyTable { rows: 2, columns: 2, bands: 1, radiance: &samples, azimuth_zero: None };
        let turned = SkyTable { azimuth_zero: Some([0.0, 1.0, 0.5]), ..table };
        let models = [
            SkyModel::Uniform,
            SkyModel::Hemisphere,
            SkyModel::Overcast,
            SkyModel::Cie { kind: 12, sun_direction: [0.3, 0.1, 0.8] },
            SkyModel::Gradient,
            SkyModel::Table(table),
            SkyModel::Table(turned),
        ];
        for model in models {
            let sky = SkyInput { model, radiance: &[1.0], ground: &[0.5], up: [0.0, 0.6, 0.8] };
            let record = SkyRecord::new(&sky);
            assert_eq!(record.samples(), Some(model.samples().len()));
            let back = record.input(&[1.0], &[0.5], model.samples()).unwrap();
            assert_eq!(std::format!("{back:?}"), std::format!("{sky:?}"));
        }
        assert!(SkyRecord::default().input(&[], &[], &[]).is_none());
        let huge = SkyRecord { model: TABLE, table: [u64::MAX; 3], ..SkyRecord::default() };
        assert_eq!(huge.samples(), None);
    }
    extern crate std;
}

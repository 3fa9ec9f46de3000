//! facets.csv: irradiance and diffuse radiance of every facet.

use std::io::{self, Write};

/// One side of one facet.
pub struct Row {
    /// Index of the facet in the mesh file's order.
    pub index: usize,
    /// 0 front, 1 back.
    pub side: usize,
    /// Area in the mesh's unit, squared.
    pub area: f64,
    /// Mean of all that arrives, per band.
    pub irradiance: Vec<f64>,
    /// Emission + rho_d irradiance / pi, per band.
    pub diffuse_radiance: Vec<f64>,
}

/// Writes the rows, which are sorted by index, then side.
pub fn write(rows: &[Row], bands: usize, to: impl Write) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(to);
    let columns = |name: &'static str| (0..bands).map(move |band| format!("{name}_{band}"));
    let head = ["index", "side", "area"].map(String::from);
    writer.write_record(head.into_iter().chain(columns("irradiance")).chain(columns("diffuse_radiance")))?;
    for row in rows {
        let values = [row.area].into_iter().chain(row.irradiance.iter().copied());
        let values = values.chain(row.diffuse_radiance.iter().copied());
        let fields = [row.index.to_string(), row.side.to_string()];
        // 17 significant digits tell every f64 from its neighbours.
        writer.write_record(fields.into_iter().chain(values.map(|x| format!("{x:.16e}"))))?;
    }
    writer.flush()
}

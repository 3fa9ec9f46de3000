//! From a scene file to its photometric image.
fn main() {}

//! File formats of lit meshes: their names and who writes them.

use std::{
    io::{self, Write},
    path::Path,
};

use super::{MeshOptions, glb::write_glb, mesh::LitMesh, ply::write_ply};

/// A file format of lit meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Binary PLY.
    Ply,
    /// Binary glTF 2.0.
    Glb,
}

/// The name of a file has no known extension.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the exported file must end in .ply or .glb: {0}")]
pub struct UnknownMeshFormat(String);

impl MeshFormat {
    /// All, in the order in which they are offered.
    pub const ALL: [Self; 2] = [Self::Ply, Self::Glb];

    /// How names of such files end, without the dot.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Glb => "glb",
        }
    }

    /// The format that the name of a file asks for.
    ///
    /// # Errors
    /// Where it ends otherwise.
    pub fn of(path: &Path) -> Result<Self, UnknownMeshFormat> {
        let ends_in = |format: &Self| {
            path.extension()
                .is_some_and(|extension| extension.eq_ignore_ascii_case(format.extension()))
        };
        Self::ALL
            .into_iter()
            .find(ends_in)
            .ok_or_else(|| UnknownMeshFormat(path.display().to_string()))
    }

    /// Write a lit mesh.
    ///
    /// # Errors
    /// Those of `out`, and one sentence where the mesh does not fit into the format.
    pub fn write(
        self,
        out: &mut dyn Write,
        lit: LitMesh<'_>,
        options: &MeshOptions,
    ) -> io::Result<()> {
        match self {
            Self::Ply => write_ply(out, lit, options),
            Self::Glb => write_glb(out, lit, options),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_a_file_tells_its_format() {
        let of = |name: &str| MeshFormat::of(Path::new(name));
        assert_eq!(of("a/lit.PLY"), Ok(MeshFormat::Ply));
        assert_eq!(of("lit.ply.glb"), Ok(MeshFormat::Glb));
        for name in ["lit.obj", "glb", "lit.", ".ply"] {
            let said = of(name).unwrap_err().to_string();
            assert!(said.contains(".ply or .glb") && said.ends_with(name));
        }
    }
}

//! File formats of lit meshes: their names and who writes them.

use std::{
    io::{self, Write},
    path::Path,
};

use super::{LitMesh, MeshOptions, glb::write_glb, obj::write_obj, ply::write_ply};
use crate::scene::{MaterialLibrary, Scene};

/// A file format of lit meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Binary PLY.
    Ply,
    /// Binary glTF 2.0.
    Glb,
    /// OBJ with colours of vertices, and its MTL file.
    Obj,
}

/// The name of a file has no known extension.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the exported file must end in .ply, .glb or .obj: {0}")]
pub struct UnknownMeshFormat(String);

impl MeshFormat {
    /// All, in the order in which they are offered.
    pub const ALL: [Self; 3] = [Self::Ply, Self::Glb, Self::Obj];

    /// How names of such files end, without the dot.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Glb => "glb",
            Self::Obj => "obj",
        }
    }

    /// Whether vertices have room for more than a colour: the light of single lamps, and light by direction.
    pub const fn holds_attributes(self) -> bool {
        match self {
            Self::Ply | Self::Glb => true,
            Self::Obj => false,
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

    /// The files that belong beside the one of this path: materials and textures of an OBJ.
    ///
    /// # Errors
    /// Where the path names no file.
    pub fn companions(self, path: &Path, scene: &Scene) -> io::Result<Option<MaterialLibrary>> {
        match self {
            Self::Ply | Self::Glb => Ok(None),
            Self::Obj => MaterialLibrary::beside(path, scene).map(Some),
        }
    }

    /// Write a lit mesh into the file of this path, whose companions are written already.
    ///
    /// # Errors
    /// Those of `out`, and one sentence where the mesh does not fit into the format.
    pub fn write(
        self,
        out: &mut dyn Write,
        path: &Path,
        lit: LitMesh<'_>,
        options: &MeshOptions,
    ) -> io::Result<()> {
        match self {
            Self::Ply => write_ply(out, lit, options),
            Self::Glb => write_glb(out, lit, options),
            Self::Obj => {
                let library = MaterialLibrary::beside(path, lit.scene)?;
                write_obj(out, lit, options, &library)
            }
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
        assert_eq!(of("lit.Obj"), Ok(MeshFormat::Obj));
        for name in ["lit.fbx", "glb", "lit.", ".ply"] {
            let said = of(name).unwrap_err().to_string();
            assert!(said.contains(".ply, .glb or .obj") && said.ends_with(name));
        }
    }
}

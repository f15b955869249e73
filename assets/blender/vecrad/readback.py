"""Read the light back: vertices of a PLY, matched to the corners of meshes."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils.kdtree import KDTree

RADIANCE = "vecrad_radiance"
IRRADIANCE = "vecrad_irradiance"

# How near a vertex of the PLY is to the corner that it came from, relative to the extent of the
# scene. Positions are single precision; a larger tolerance takes thin walls for one place.
TOLERANCE = 2e-6

# The cosine up to which a normal is taken for that of another face at the corner.
OTHER_FACE = 0.25

# What it counts that a vertex has triangles on the corner's side of a seam, relative to the normal.
SEAM_SHARE = 0.1

NUMPY_TYPES = {"float": "<f4", "double": "<f8", "uchar": "u1"}


@dataclass
class LitVertices:
    """The vertices of a PLY, in Blender's axes."""

    positions: np.ndarray
    normals: np.ndarray
    # Unit vector from the vertex towards its triangles; short or zero where they surround it.
    inward: np.ndarray
    radiance: np.ndarray
    irradiance: np.ndarray


@dataclass
class Corners:
    """The corners of a mesh in the world, as they were when the scene was handed over."""

    object_name: str
    mesh_name: str
    # Vertices of the mesh, and which of them each corner has.
    positions: np.ndarray
    vertices: np.ndarray
    normals: np.ndarray
    # Unit vector from each corner towards the middle of its face.
    inward: np.ndarray
    # Whether modifiers make other corners than these.
    is_modified: bool


def read_ply(path: Path) -> LitVertices:
    """Read a binary PLY that vecrad wrote of a glTF scene."""
    with path.open("rb") as file:
        fields: list[tuple[str, str]] = []
        counts: dict[str, int] = {}
        element = ""
        while (words := file.readline().decode().split()) != ["end_header"]:
            match words:
                case ["element", element, count]:
                    counts[element] = int(count)
                case ["property", kind, name] if element == "vertex":
                    fields.append((name, NUMPY_TYPES[kind]))
                case []:
                    raise ValueError("the header does not end")
        data = np.fromfile(file, np.dtype(fields), counts["vertex"])
        triangle = np.dtype([("corners", "u1"), ("vertices", "<i4", 3)])
        triangles = np.fromfile(file, triangle, counts["face"])["vertices"]
    if len(data) < counts["vertex"] or len(triangles) < counts["face"]:
        raise ValueError("the file ends early")
    positions = to_blender(columns(data, "x", "y", "z"))
    normals = to_blender(columns(data, "nx", "ny", "nz"))
    light = {
        kind: columns(data, f"{kind}_r", f"{kind}_g", f"{kind}_b")
        for kind in ("radiance", "irradiance")
    }
    middles = positions[triangles].mean(axis=1)
    inward = np.zeros_like(positions)
    for corner in range(3):
        of_corner = triangles[:, corner]
        np.add.at(inward, of_corner, unit(middles - positions[of_corner]))
    return LitVertices(positions, normals, unit(inward), light["radiance"], light["irradiance"])


def columns(data: np.ndarray, *names: str) -> np.ndarray:
    """Some fields of records side by side, as doubles."""
    return np.stack([data[name].astype(np.float64) for name in names], axis=1)


def to_blender(vectors: np.ndarray) -> np.ndarray:
    """From glTF's axes, Y up, to Blender's, Z up."""
    return np.stack([vectors[:, 0], -vectors[:, 2], vectors[:, 1]], axis=1)


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors of length 1; zero where they were."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, lengths, out=np.zeros_like(vectors), where=lengths > 0.0)


def corners_of(
    context: bpy.types.Context, objects: Iterable[bpy.types.Object]
) -> tuple[list[Corners], list[str]]:
    """The corners of all meshes that can keep light, and warnings about those that cannot."""
    corners: list[Corners] = []
    shared: list[str] = []
    fixed: list[str] = []
    modified: list[str] = []
    taken: set[str] = set()
    depsgraph = context.evaluated_depsgraph_get()
    meshes = [obj for obj in objects if obj.type == "MESH" and obj.data.loops]
    for obj in sorted(meshes, key=lambda obj: obj.name):
        if not obj.data.is_editable:
            fixed.append(obj.name)
            continue
        if obj.data.name in taken:
            shared.append(obj.name)
            continue
        taken.add(obj.data.name)
        found = corners_of_object(obj, depsgraph)
        corners.append(found)
        if found.is_modified:
            modified.append(obj.name)
    warnings = [
        f"{sentence}: {', '.join(names)}"
        for names, sentence in [
            (shared, "Meshes that several objects share have the light of the first; left out"),
            (fixed, "Meshes from libraries cannot keep light"),
            (modified, "Modifiers make other vertices than those that keep the light"),
        ]
        if names
    ]
    return corners, warnings


def corners_of_object(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Corners:
    """The corners of an object's mesh; where modifiers only move them, where they are then."""
    evaluated = obj.evaluated_get(depsgraph)
    final = evaluated.to_mesh()
    original = obj.data
    is_modified = len(final.vertices) != len(original.vertices) or len(final.loops) != len(
        original.loops
    )
    mesh = original if is_modified else final
    to_world = np.array(evaluated.matrix_world)
    linear = to_world[:3, :3]
    positions = values(mesh.vertices, "co", 3) @ linear.T + to_world[:3, 3]
    vertices = values(mesh.loops, "vertex_index", 1, np.int32).ravel()
    # The transposed inverse but for its length, for flat scales, too.
    cofactors = np.stack([np.cross(linear[row - 2], linear[row - 1]) for row in range(3)])
    normals = unit(values(mesh.corner_normals, "vector", 3) @ cofactors.T)
    if np.linalg.det(linear) < 0.0:
        normals = -normals
    sizes = values(mesh.polygons, "loop_total", 1, np.int32).ravel()
    middles = values(mesh.polygons, "center", 3) @ linear.T + to_world[:3, 3]
    inward = unit(np.repeat(middles, sizes, axis=0) - positions[vertices])
    evaluated.to_mesh_clear()
    return Corners(obj.name, original.name, positions, vertices, normals, inward, is_modified)


def values(
    collection: bpy.types.bpy_prop_collection, name: str, width: int, kind: type = np.float32
) -> np.ndarray:
    """A property of everything in a collection, one row each."""
    found = np.empty(len(collection) * width, kind)
    collection.foreach_get(name, found)
    return found.reshape(-1, width)


class Matcher:
    """Finds the lit vertex of each corner."""

    def __init__(self, lit: LitVertices) -> None:
        self._lit = lit
        least, most = lit.positions.min(axis=0), lit.positions.max(axis=0)
        # The tree has single precision: count from the middle.
        self._origin = (least + most) / 2
        self._tolerance = TOLERANCE * float(np.linalg.norm(most - least))
        self._tree = KDTree(len(lit.positions))
        for index, position in enumerate(lit.positions - self._origin):
            self._tree.insert(position, index)
        self._tree.balance()

    def match(self, corners: Corners) -> tuple[np.ndarray, int]:
        """The lit vertex for each corner, and how many corners have only one elsewhere."""
        candidates: list[list[int]] = []
        are_far = np.zeros(len(corners.positions), bool)
        for vertex, position in enumerate(corners.positions - self._origin):
            near = [index for _, index, _ in self._tree.find_range(position, self._tolerance)]
            if not near:
                are_far[vertex] = True
                near = [self._tree.find(position)[1]]
            candidates.append(near)
        return self._choose(corners, candidates), int(are_far[corners.vertices].sum())

    def _choose(self, corners: Corners, candidates: list[list[int]]) -> np.ndarray:
        """The candidate for each corner: on the same face, on the same side of seams."""
        counts = np.array([len(near) for near in candidates])
        flat = np.concatenate([np.array(near) for near in candidates])
        starts = np.cumsum(counts) - counts
        per_corner = counts[corners.vertices]
        ends = np.cumsum(per_corner)
        # All pairs of a corner and a candidate, the candidates of one corner in a row.
        corner = np.repeat(np.arange(len(per_corner)), per_corner)
        place = np.arange(ends[-1]) - np.repeat(ends - per_corner, per_corner)
        candidate = flat[starts[corners.vertices][corner] + place]
        facing = np.einsum("ij,ij->i", corners.normals[corner], self._lit.normals[candidate])
        beside = np.einsum("ij,ij->i", corners.inward[corner], self._lit.inward[candidate])
        # The other side of the same face, where only that is lit, comes before other faces.
        facing = np.where(facing > OTHER_FACE, facing, np.abs(facing) - 1.0)
        order = np.lexsort((facing + SEAM_SHARE * beside, corner))
        return candidate[order[ends - 1]]


def write_light(mesh: bpy.types.Mesh, lit: LitVertices, chosen: np.ndarray) -> None:
    """Keep the light of the chosen vertices at the corners of a mesh."""
    for name, light in [(RADIANCE, lit.radiance), (IRRADIANCE, lit.irradiance)]:
        attribute = mesh.attributes.get(name)
        if attribute is not None and (attribute.domain, attribute.data_type) != (
            "CORNER",
            "FLOAT_COLOR",
        ):
            mesh.attributes.remove(attribute)
            attribute = None
        if attribute is None:
            attribute = mesh.color_attributes.new(name, "FLOAT_COLOR", "CORNER")
        colors = np.ones((len(chosen), 4), np.float32)
        colors[:, :3] = light[chosen]
        attribute.data.foreach_set("color", colors.ravel())
    mesh.update()

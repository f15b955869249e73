"""Hand a scene over: what is lit, as a GLB, and the program that lights it."""

import math
import re
import shutil
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy

from . import show

# Sides of the polygon that stands for a round area light.
ROUND_SIDES = 32

# Blender's exporter of glTF, as the name of an add-on.
EXPORTER = "io_scene_gltf2"

# "error 3.1 % (2.0…4.2)" or "error below 3.1 %" in a progress line.
ERROR_IN_LINE = re.compile(r"error (?:below )?([\d.]+) %")


class VecradError(Exception):
    """Something that the user is told in one sentence."""


def find_program(path: str) -> str:
    """The program at a path, or of a name that the system knows."""
    found = shutil.which(bpy.path.abspath(path) if path.startswith("//") else path)
    if found is None:
        raise VecradError(
            f"There is no program '{path}': name vecrad's in the preferences of the add-on"
        )
    return found


def handed_over(context: bpy.types.Context, only_selected: bool) -> list[bpy.types.Object]:
    """The selected objects, or those of the scene that a render shows."""
    if only_selected:
        return list(context.selected_objects)
    return [
        obj
        for obj in context.view_layer.objects
        if not obj.hide_render
        and not all(collection.hide_render for collection in obj.users_collection)
    ]


def export(context: bpy.types.Context, only_selected: bool, path: Path) -> None:
    """Write the scene as GLB, in watts and metres as Cycles understands them.

    In the lighting mode COMPAT a lamp of P watts has P / 4π watts per steradian, and a sun as many
    watts per square metre as in Blender. SPEC would multiply both by 683 lumens per watt, but not
    what materials emit.
    """
    if EXPORTER not in context.preferences.addons:
        raise VecradError(
            "Blender's add-on 'glTF 2.0 format' is off: turn it on in the preferences"
        )
    objects = handed_over(context, only_selected)
    wanted = {
        "filepath": str(path),
        "export_format": "GLB",
        "use_selection": only_selected,
        "use_renderable": not only_selected,
        "use_active_scene": True,
        "export_apply": True,
        "export_yup": True,
        "export_lights": True,
        "export_import_convert_lighting_mode": "COMPAT",
        "export_animations": False,
        "export_skins": False,
        "export_morph": False,
        "export_gn_mesh": True,
        # Light of an earlier run is no colour of the surface.
        "export_all_vertex_colors": False,
        "export_active_vertex_color_when_no_material": False,
    }
    known = bpy.ops.export_scene.gltf.get_rna_type().properties
    settings = {name: value for name, value in wanted.items() if name in known}
    with show.taken_back(objects), area_lights_as_meshes(context, objects):
        try:
            bpy.ops.export_scene.gltf(**settings)
        except RuntimeError as error:
            reason = str(error).strip().splitlines()[-1]
            raise VecradError(f"Blender could not write the scene as glTF: {reason}") from error


@contextmanager
def area_lights_as_meshes(
    context: bpy.types.Context, objects: list[bpy.types.Object]
) -> Iterator[None]:
    """Put glowing faces where area lights are, which glTF does not know, while this lasts."""
    lamps = [obj for obj in objects if obj.type == "LIGHT" and obj.data.type == "AREA"]
    faces = [glowing_face(context, lamp) for lamp in lamps]
    try:
        yield
    finally:
        for face in faces:
            mesh = face.data
            (material,) = mesh.materials
            bpy.data.objects.remove(face)
            bpy.data.meshes.remove(mesh)
            bpy.data.materials.remove(material)


def glowing_face(context: bpy.types.Context, lamp: bpy.types.Object) -> bpy.types.Object:
    """A face with the shape, place and radiance of an area light."""
    light = lamp.data
    width = light.size
    height = light.size_y if light.shape in {"RECTANGLE", "ELLIPSE"} else width
    if light.shape in {"DISK", "ELLIPSE"}:
        turns = [2 * math.pi * side / ROUND_SIDES for side in range(ROUND_SIDES)]
        outline = [(math.cos(turn) / 2, math.sin(turn) / 2) for turn in turns]
    else:
        outline = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
    corners = [(x * width, y * height, 0.0) for x, y in outline]
    mesh = bpy.data.meshes.new(lamp.name)
    # An area light shines along its -Z.
    mesh.from_pydata(corners, [], [list(reversed(range(len(corners))))])
    scale = lamp.matrix_world.to_scale()
    mesh.materials.append(glow(lamp, mesh.polygons[0].area * abs(scale.x * scale.y)))
    face = bpy.data.objects.new(lamp.name, mesh)
    face.matrix_world = lamp.matrix_world
    context.scene.collection.objects.link(face)
    face.select_set(True)
    return face


def glow(lamp: bpy.types.Object, area: float) -> bpy.types.Material:
    """A black material that emits, on its front, what an area light does over its area."""
    light = lamp.data
    color = list(light.color)
    power = light.energy
    # Blender 4.2 has none of these yet.
    if getattr(light, "use_temperature", False):
        color = [a * b for a, b in zip(color, light.temperature_color, strict=True)]
    power *= 2.0 ** getattr(light, "exposure", 0.0)
    if getattr(light, "normalize", True):
        power /= area
    material = bpy.data.materials.new(lamp.name)
    material.use_nodes = True
    material.use_backface_culling = True
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    shader.inputs["Emission Color"].default_value = (*color, 1.0)
    # Even radiance: power over area and the projected hemisphere.
    shader.inputs["Emission Strength"].default_value = power / math.pi
    return material


def sky_of(world: bpy.types.World | None) -> tuple[list[str], str | None]:
    """Flags for the world's light, and a warning where it is more than one colour.

    Black leaves the sky to vecrad.
    """
    if world is None:
        return [], None
    if not world.use_nodes:
        color = tuple(world.color)
    else:
        output = world.node_tree.get_output_node("ALL")
        links = output.inputs["Surface"].links if output is not None else ()
        if not links:
            return [], None
        node = links[0].from_node
        if node.type != "BACKGROUND" or any(socket.is_linked for socket in node.inputs):
            return [], "Only a Background node of one colour is handed over as sky, not this world"
        strength = node.inputs["Strength"].default_value
        color = tuple(strength * part for part in node.inputs["Color"].default_value[:3])
    if max(color) <= 0.0:
        return [], None
    return ["--sky", ",".join(f"{part:.9g}" for part in color)], None


class Run:
    """A running vecrad, whose standard error is read without waiting for it."""

    def __init__(self, command: list[str]) -> None:
        self.progress = "preparing"
        self.remarks: list[str] = []
        self._error = ""
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                encoding="utf-8",
                errors="replace",
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )
        except OSError as error:
            raise VecradError(f"Cannot start {command[0]}: {error.strerror}") from error
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        for line in self._process.stderr:
            line = line.strip()
            if line.startswith(("warning: ", "note: ")):
                self.remarks.append(f"vecrad: {line.partition(': ')[2]}")
            elif line.startswith("error: "):
                self._error = line.removeprefix("error: ")
            elif line:
                self.progress = line

    def reached(self) -> float | None:
        """The estimated error in per cent that the last step has reached."""
        found = ERROR_IN_LINE.search(self.progress)
        return float(found[1]) if found else None

    def is_over(self) -> bool:
        """Whether the program has ended."""
        return self._process.poll() is not None

    def wait(self) -> None:
        """Wait until the program has ended, and check that it wrote what was asked for."""
        code = self._process.wait()
        self._close()
        # 4: stopped early by a limit, but written.
        if code not in {0, 4}:
            raise VecradError(f"vecrad: {self._error or f'ended with code {code}'}")

    def kill(self) -> None:
        """End the program at once: asked kindly, it would still write its outputs."""
        self._process.kill()
        self._process.wait()
        self._close()

    def _close(self) -> None:
        self._reader.join()
        self._process.stderr.close()

"""Test the add-on for Blender in the `bpy` package: `python addon.py VECRAD`, a path."""

import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path
from types import MethodType, SimpleNamespace

FOLDER = Path(tempfile.mkdtemp(prefix="vecrad-blender-"))
# Read when bpy is loaded: nothing of the user's is read or written.
os.environ["BLENDER_USER_RESOURCES"] = str(FOLDER / "user")

import bpy  # noqa: E402
import numpy as np  # noqa: E402

PROGRAM = ""
ADDON = Path(__file__).parents[2] / "assets/blender/vecrad"
MODULE = "bl_ext.user_default.vecrad"
NAMES = ("vecrad_radiance", "vecrad_irradiance")


def material(name, color=(0.6, 0.6, 0.6), strength=0.0):
    """A matt material that may emit white."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = next(node for node in made.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (*color, 1.0)
    shader.inputs["Roughness"].default_value = 1.0
    shader.inputs["Emission Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    shader.inputs["Emission Strength"].default_value = strength
    return made


def build_room():
    """A closed room with a lamp under its ceiling, a turned box and a ball."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module=MODULE)
    preferences().program = PROGRAM
    preferences().error = 10.0
    bpy.ops.mesh.primitive_cube_add(size=4, location=(0, 0, 2))
    add("room", material("white"))
    bpy.context.object.data.flip_normals()
    bpy.ops.mesh.primitive_plane_add(size=1, location=(0, 0, 3.9), rotation=(np.pi, 0, 0))
    add("lamp", material("lamp", (0, 0, 0), 10.0))
    bpy.ops.mesh.primitive_cube_add(size=1, location=(-0.9, 0.5, 0.6), rotation=(0, 0, 0.4))
    add("box", material("red", (0.6, 0.1, 0.1)))
    bpy.context.object.scale = (-1, 0.7, 1)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5, location=(0.9, -0.6, 0.7))
    add("ball", material("green", (0.1, 0.5, 0.1)))
    bpy.ops.object.shade_smooth()
    bpy.ops.object.select_all(action="DESELECT")


def add(name, of_material):
    """Name the active object and give it a material."""
    bpy.context.object.name = name
    bpy.context.object.data.name = name
    bpy.context.object.data.materials.append(of_material)


def build_much():
    """So much in the room that a precise run takes many seconds on any machine."""
    preferences().error = 0.1
    for place in range(8):
        at = (1.5 * np.cos(place), 1.5 * np.sin(place), 0.4 + 0.4 * place)
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=6, radius=0.2, location=at)
        add(f"ball {place}", bpy.data.materials["green"])
    bpy.ops.object.select_all(action="DESELECT")


def preferences():
    """Those of the add-on."""
    return bpy.context.preferences.addons[MODULE].preferences


def light_of(name, attribute="vecrad_radiance"):
    """The colours of an object's corners, without alpha."""
    data = bpy.data.objects[name].data.attributes[attribute].data
    colors = np.empty(4 * len(data), np.float32)
    data.foreach_get("color", colors)
    return colors.reshape(-1, 4)[:, :3]


def lit_objects():
    """Names of the objects that have light."""
    return {
        obj.name
        for obj in bpy.data.objects
        if obj.type == "MESH" and any(name in obj.data.attributes for name in NAMES)
    }


def left_behind():
    """Files of the add-on that are still there."""
    return [path for path in Path(bpy.app.tempdir).iterdir() if path.name.startswith("vecrad-")]


def event(kind):
    """One that Blender sends to an operator."""
    return SimpleNamespace(type=kind, value="PRESS")


class Window:
    """What an operator finds in the context of a window, which `bpy` has none of."""

    def __init__(self):
        self.status = None
        self.progress = []
        self.window = None
        self.workspace = SimpleNamespace(status_text_set=self.set_status)
        self.window_manager = SimpleNamespace(
            progress_begin=lambda _least, _most: None,
            progress_update=self.progress.append,
            progress_end=lambda: None,
            event_timer_add=lambda _seconds, window: window,
            event_timer_remove=lambda _timer: None,
        )

    def __getattr__(self, name):
        return getattr(bpy.context, name)

    def set_status(self, text):
        """Text of the status bar."""
        self.status = text


class Operator:
    """The add-on's operator, called as Blender calls it where there is a window."""

    scope = "SCENE"

    def __init__(self):
        self.reports = []

    def __getattr__(self, name):
        method = getattr(sys.modules[MODULE].VECRAD_OT_light, name)
        return MethodType(method, self)

    def report(self, kind, sentence):
        """What the user reads."""
        self.reports.append((kind, sentence))


class Light(unittest.TestCase):
    """What the add-on does with a scene."""

    def setUp(self):
        build_room()

    def tearDown(self):
        self.assertEqual(left_behind(), [])

    def kept_light(self, **arguments):
        """Light the scene; returns the vertices of the PLY that was read."""
        readback = sys.modules[f"{MODULE}.readback"]
        read, kept = readback.read_ply, []

        def read_and_keep(path):
            kept.append(read(path))
            return kept[-1]

        readback.read_ply = read_and_keep
        try:
            self.assertEqual(bpy.ops.vecrad.light(**arguments), {"FINISHED"})
        finally:
            readback.read_ply = read
        return kept[0]

    def check_corners(self, name, lit):
        """Each corner has the light of a vertex at its place that faces as it does."""
        obj = bpy.data.objects[name]
        mesh = obj.data
        normal_matrix = obj.matrix_world.to_3x3().inverted().transposed()
        light = np.concatenate([light_of(name, attribute) for attribute in NAMES], axis=1)
        of_vertices = np.concatenate([lit.radiance, lit.irradiance], axis=1).astype(np.float32)
        for loop, found in zip(mesh.loops, light, strict=True):
            place = np.array(obj.matrix_world @ mesh.vertices[loop.vertex_index].co)
            normal = np.array((normal_matrix @ mesh.corner_normals[loop.index].vector).normalized())
            is_near = np.linalg.norm(lit.positions - place, axis=1) < 1e-4
            near = np.flatnonzero(is_near & (lit.normals @ normal > 0.99))
            self.assertGreater(len(near), 0, f"{name}, corner {loop.index}")
            self.assertTrue((of_vertices[near] == found).all(axis=1).any(), f"{name}: {found}")

    def test_light_is_that_of_the_ply(self):
        lit = self.kept_light()
        self.assertEqual(lit_objects(), {"room", "lamp", "box", "ball"})
        for name in lit_objects():
            self.check_corners(name, lit)
        np.testing.assert_allclose(light_of("lamp"), 10.0, rtol=1e-5)
        self.assertTrue((light_of("room") > 0.0).all())
        # A matt surface reflects its share of what arrives.
        expected = light_of("room", "vecrad_irradiance") * 0.6 / np.pi
        np.testing.assert_allclose(light_of("room"), expected, rtol=0.05)

    def test_lighting_twice_is_lighting_once(self):
        bpy.ops.vecrad.light()
        first = {name: light_of(name) for name in lit_objects()}
        bpy.ops.vecrad.show()
        bpy.ops.vecrad.light()
        for name, light in first.items():
            np.testing.assert_array_equal(light_of(name), light)

    def test_only_the_selection_is_lit(self):
        for name in ("lamp", "box"):
            bpy.data.objects[name].select_set(True)
        self.assertEqual(bpy.ops.vecrad.light(scope="SELECTION"), {"FINISHED"})
        self.assertEqual(lit_objects(), {"lamp", "box"})

    def test_what_is_not_rendered_is_not_lit(self):
        bpy.data.objects["ball"].hide_render = True
        bpy.ops.vecrad.light()
        self.assertEqual(lit_objects(), {"room", "lamp", "box"})

    def test_area_lights_shine_and_leave_nothing(self):
        bpy.data.objects.remove(bpy.data.objects["lamp"])
        bpy.ops.object.light_add(type="AREA", location=(0, 0, 3.9))
        bpy.context.object.data.energy = 40.0
        before = [len(bpy.data.objects), len(bpy.data.meshes), len(bpy.data.materials)]
        bpy.ops.vecrad.light()
        after = [len(bpy.data.objects), len(bpy.data.meshes), len(bpy.data.materials)]
        self.assertEqual(after, before)
        area_light = light_of("room").copy()
        # The same as a glowing face.
        bpy.data.objects.remove(bpy.context.object)
        bpy.ops.mesh.primitive_plane_add(size=1, location=(0, 0, 3.9), rotation=(np.pi, 0, 0))
        add("lamp", material("glow", (0, 0, 0), 40.0 / np.pi))
        bpy.data.materials["glow"].use_backface_culling = True
        bpy.ops.vecrad.light()
        np.testing.assert_allclose(area_light.mean(), light_of("room").mean(), rtol=0.02)

    def test_the_world_is_the_sky(self):
        for name in ("room", "lamp"):
            bpy.data.objects.remove(bpy.data.objects[name])
        world = bpy.data.worlds.new("world")
        world.use_nodes = True
        bpy.context.scene.world = world
        background = world.node_tree.nodes["Background"]
        background.inputs["Color"].default_value = (0.5, 0.25, 1.0, 1.0)
        background.inputs["Strength"].default_value = 2.0
        bpy.ops.vecrad.light()
        # The top of the box sees nothing else.
        top = light_of("box", "vecrad_irradiance").max(axis=0)
        np.testing.assert_allclose(top, np.pi * np.array([1.0, 0.5, 2.0]), rtol=0.02)

    def test_materials_come_back(self):
        bpy.ops.mesh.primitive_plane_add(size=0.5, location=(0, 0, 1))
        bare = bpy.context.object
        box = bpy.data.objects["box"]
        box.material_slots[0].link = "OBJECT"
        box.material_slots[0].material = bpy.data.materials["green"]
        bpy.ops.vecrad.light()

        def slots():
            return {
                obj.name: [(slot.link, slot.material) for slot in obj.material_slots]
                for obj in bpy.data.objects
            }

        before = slots()
        self.assertEqual(bpy.ops.vecrad.show(), {"FINISHED"})
        shown = bpy.data.materials["vecrad light"]
        for name in lit_objects():
            obj = bpy.data.objects[name]
            self.assertEqual([slot.material for slot in obj.material_slots], [shown])
        self.assertEqual(bpy.ops.vecrad.hide(), {"FINISHED"})
        self.assertEqual(slots(), before)
        self.assertEqual(len(bare.material_slots), 0)

    def test_a_cancelled_run_leaves_nothing(self):
        build_much()
        window = Window()
        operator = Operator()
        self.assertTrue(operator._start(window))
        operator._watch(window)
        run = operator._session.run
        while not run.progress.startswith("step"):
            time.sleep(0.05)
            self.assertEqual(operator.modal(window, event("TIMER")), {"PASS_THROUGH"})
        self.assertEqual(len(left_behind()), 1)
        operator.modal(window, event("TIMER"))
        self.assertIn("step", window.status)
        self.assertEqual(operator.modal(window, event("ESC")), {"CANCELLED"})
        self.assertTrue(run.is_over())
        self.assertIsNone(window.status)
        self.assertEqual(lit_objects(), set())

    def test_a_run_in_the_background_ends_with_light(self):
        window = Window()
        operator = Operator()
        self.assertTrue(operator._start(window))
        operator._watch(window)
        self.assertFalse(bpy.ops.vecrad.light.poll())
        while (state := operator.modal(window, event("TIMER"))) == {"PASS_THROUGH"}:
            time.sleep(0.05)
        self.assertEqual(state, {"FINISHED"})
        self.assertEqual(lit_objects(), {"room", "lamp", "box", "ball"})
        self.assertTrue(bpy.ops.vecrad.light.poll())
        self.assertEqual([kind for kind, _ in operator.reports], [{"INFO"}])

    def test_what_cannot_keep_its_light_is_named(self):
        ball = bpy.data.objects["ball"]
        twin = bpy.data.objects.new("twin", ball.data)
        twin.location = (-1.2, -1.2, 0.7)
        bpy.context.scene.collection.objects.link(twin)
        bpy.data.objects["box"].modifiers.new("bevel", "BEVEL")
        # Corners that are only moved keep their light.
        bpy.data.objects["room"].modifiers.new("cast", "CAST").factor = 0.1
        operator = Operator()
        self.assertEqual(operator.execute(bpy.context), {"FINISHED"})
        warnings = [sentence for kind, sentence in operator.reports if kind == {"WARNING"}]
        self.assertEqual(len(warnings), 2, warnings)
        self.assertTrue(warnings[0].endswith("left out: twin"), warnings)
        self.assertTrue(warnings[1].endswith("keep the light: box"), warnings)

    def test_a_program_that_is_killed_is_one_sentence(self):
        build_much()
        handover = sys.modules[f"{MODULE}.handover"]
        started = []

        class Watched(subprocess.Popen):
            def __init__(self, *arguments, **names):
                super().__init__(*arguments, **names)
                started.append(self)
                threading.Timer(1.0, self.kill).start()

        popen, handover.subprocess.Popen = subprocess.Popen, Watched
        try:
            self.refused("vecrad: ended with code")
        finally:
            handover.subprocess.Popen = popen
        self.assertEqual(len(started), 1)
        self.assertEqual(lit_objects(), set())

    def test_errors_are_one_sentence(self):
        preferences().program = str(FOLDER / "no-such-program")
        self.refused("There is no program")
        preferences().program = PROGRAM
        self.refused("There is no mesh to light", scope="SELECTION")
        # A program that is none of ours.
        preferences().program = shutil.which("false")
        self.refused("vecrad: ended with code 1")
        self.assertEqual(lit_objects(), set())

    def refused(self, sentence, **arguments):
        """The operator reports this."""
        with self.assertRaises(RuntimeError) as caught:
            bpy.ops.vecrad.light(**arguments)
        lines = str(caught.exception).strip().splitlines()
        self.assertEqual(len(lines), 1, lines)
        self.assertIn(sentence, lines[0])


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    shutil.make_archive(str(FOLDER / "vecrad"), "zip", ADDON)
    try:
        bpy.ops.extensions.package_install_files(
            filepath=str(FOLDER / "vecrad.zip"), repo="user_default"
        )
        unittest.main()
    finally:
        shutil.rmtree(FOLDER, ignore_errors=True)

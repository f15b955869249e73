"""One run from the scene to the light in its meshes, in steps that do not block Blender."""

import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

import bpy

from . import handover, readback
from .handover import Run, VecradError


@dataclass
class Outcome:
    """What a run has done."""

    lit: int
    warnings: list[str]


class Session:
    """Hands the scene over when made; afterwards `finish` or `cancel` is called, once."""

    def __init__(
        self, context: bpy.types.Context, program: str, error: float, only_selected: bool
    ) -> None:
        program = handover.find_program(program)
        # Scripts may have added and moved objects.
        context.view_layer.update()
        objects = handover.handed_over(context, only_selected)
        self._corners, self._warnings = readback.corners_of(context, objects)
        if not self._corners:
            raise VecradError("There is no mesh to light")
        sky, warning = handover.sky_of(context.scene.world)
        if warning is not None:
            self._warnings.append(warning)
        # Blender removes its folder when it quits, whatever has happened.
        self._folder = Path(tempfile.mkdtemp(prefix="vecrad-", dir=bpy.app.tempdir))
        try:
            scene = self._folder / "scene.glb"
            handover.export(context, only_selected, scene)
            self._light = self._folder / "light.ply"
            asked = ["--error", f"{error:g}%", "--export", str(self._light)]
            self.run = Run([program, "solve", str(scene), *asked, *sky])
        except BaseException:
            self._clean()
            raise

    def finish(self) -> Outcome:
        """Wait for the end of the run and keep its light in the meshes."""
        try:
            self.run.wait()
            lit = readback.read_ply(self._light)
        except (OSError, ValueError) as error:
            raise VecradError(f"The light that vecrad wrote cannot be read: {error}") from error
        finally:
            self.cancel()
        warnings = self._warnings + self.run.remarks
        matcher = readback.Matcher(lit)
        changed: list[str] = []
        strayed: list[str] = []
        count = 0
        for corners in self._corners:
            mesh = bpy.data.meshes.get(corners.mesh_name)
            if mesh is None or len(mesh.loops) != len(corners.vertices):
                changed.append(corners.object_name)
                continue
            chosen, far = matcher.match(corners)
            if far and not corners.is_modified:
                strayed.append(f"{corners.object_name} ({far})")
            readback.write_light(mesh, lit, chosen)
            count += 1
        if changed:
            warnings.append(f"Changed during the run, and left out: {', '.join(changed)}")
        if strayed:
            names = ", ".join(strayed)
            warnings.append(f"Corners that are not in the lit mesh have the nearest light: {names}")
        return Outcome(count, warnings)

    def cancel(self) -> None:
        """End the run, and leave nothing behind."""
        self.run.kill()
        self._clean()

    def _clean(self) -> None:
        shutil.rmtree(self._folder, ignore_errors=True)

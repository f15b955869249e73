"""Light with vecrad: hands a scene to vecrad and keeps the light in the colours of its meshes."""

import bpy

from . import show
from .handover import VecradError
from .session import Outcome, Session

# Seconds between looks at the running program.
INTERVAL = 0.1


class VecradPreferences(bpy.types.AddonPreferences):
    """Where vecrad is, and how exact it shall be."""

    bl_idname = __package__

    program: bpy.props.StringProperty(
        name="Program",
        description="vecrad's program: a path, or a name that the system finds",
        subtype="FILE_PATH",
        default="vecrad",
    )
    error: bpy.props.FloatProperty(
        name="Error",
        description="Refine until the estimated error is at most this",
        subtype="PERCENTAGE",
        default=5.0,
        min=0.1,
        max=50.0,
        precision=1,
    )

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.prop(self, "program")
        self.layout.prop(self, "error")


class VECRAD_OT_light(bpy.types.Operator):
    """Light meshes by radiosity; the light is kept in their colour attributes. Esc cancels"""

    bl_idname = "vecrad.light"
    bl_label = "Light with vecrad"
    bl_options = {"UNDO"}

    scope: bpy.props.EnumProperty(
        name="Scope",
        items=[
            ("SCENE", "Scene", "All that a render of the scene shows"),
            ("SELECTION", "Selection", "Selected objects only, lamps among them"),
        ],
        default="SCENE",
    )

    # Whether one runs in the background.
    is_running = False

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.mode == "OBJECT" and not cls.is_running

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Light and wait for it: scripts, and Blender without a window."""
        if not self._start(context):
            return {"CANCELLED"}
        return self._finish()

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Light in the background."""
        if bpy.app.background:
            return self.execute(context)
        if not self._start(context):
            return {"CANCELLED"}
        self._watch(context)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Look at the run with each tick of the timer."""
        if event.type == "ESC" and event.value == "PRESS":
            self.cancel(context)
            self.report({"INFO"}, "Cancelled; no light was changed")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        run = self._session.run
        if run.is_over():
            self._stop_watching(context)
            return self._finish()
        context.workspace.status_text_set(f"vecrad: {run.progress}    Esc: cancel")
        reached = run.reached()
        if reached is not None:
            # Time grows as the inverse square of the error.
            context.window_manager.progress_update(99 * min(1.0, (self._error / reached) ** 2))
        return {"PASS_THROUGH"}

    def cancel(self, context: bpy.types.Context) -> None:
        """End the run: Esc, or Blender opens another file or quits."""
        self._stop_watching(context)
        self._session.cancel()

    def _start(self, context: bpy.types.Context) -> bool:
        preferences = context.preferences.addons[__package__].preferences
        self._error = preferences.error
        try:
            self._session = Session(
                context, preferences.program, self._error, self.scope == "SELECTION"
            )
        except VecradError as error:
            self.report({"ERROR"}, str(error))
            return False
        return True

    def _finish(self) -> set[str]:
        try:
            outcome: Outcome = self._session.finish()
        except VecradError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for warning in outcome.warnings:
            self.report({"WARNING"}, warning)
        meshes = "1 mesh" if outcome.lit == 1 else f"{outcome.lit} meshes"
        self.report({"INFO"}, f"{meshes} lit: {self._session.run.progress}")
        return {"FINISHED"}

    def _watch(self, context: bpy.types.Context) -> None:
        VECRAD_OT_light.is_running = True
        context.window_manager.progress_begin(0, 100)
        self._timer = context.window_manager.event_timer_add(INTERVAL, window=context.window)

    def _stop_watching(self, context: bpy.types.Context) -> None:
        VECRAD_OT_light.is_running = False
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        if context.workspace is not None:
            context.workspace.status_text_set(None)


class VECRAD_OT_show(bpy.types.Operator):
    """Show the light of lit meshes in place of their materials, which are kept"""

    bl_idname = "vecrad.show"
    bl_label = "Show Light"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.mode == "OBJECT"

    def execute(self, context: bpy.types.Context) -> set[str]:
        if show.show(context.scene.objects) == 0:
            self.report({"WARNING"}, "There is no more light to show: light the scene first")
            return {"CANCELLED"}
        return {"FINISHED"}


class VECRAD_OT_hide(bpy.types.Operator):
    """Give meshes whose light is shown their own materials back"""

    bl_idname = "vecrad.hide"
    bl_label = "Show Materials"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.mode == "OBJECT"

    def execute(self, context: bpy.types.Context) -> set[str]:
        return {"FINISHED"} if show.hide(context.scene.objects) else {"CANCELLED"}


class VECRAD_PT_light(bpy.types.Panel):
    """Buttons in the sidebar of the 3D view."""

    bl_label = "Light with vecrad"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "vecrad"

    def draw(self, context: bpy.types.Context) -> None:
        column = self.layout.column(align=True)
        for scope, text in [("SCENE", "Light Scene"), ("SELECTION", "Light Selection")]:
            column.operator(VECRAD_OT_light.bl_idname, text=text, icon="LIGHT").scope = scope
        preferences = context.preferences.addons[__package__].preferences
        self.layout.prop(preferences, "error")
        row = self.layout.row(align=True)
        row.operator(VECRAD_OT_show.bl_idname)
        row.operator(VECRAD_OT_hide.bl_idname)


CLASSES = (VecradPreferences, VECRAD_OT_light, VECRAD_OT_show, VECRAD_OT_hide, VECRAD_PT_light)


def register() -> None:
    """Called when the add-on is turned on."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Called when the add-on is turned off."""
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)

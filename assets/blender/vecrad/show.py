"""A material that shows the light, put before those of objects and taken back without a trace.

Slots of objects are linked to the object and hold the material that shows the light; the mesh keeps
its own materials.
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

import bpy

from .readback import RADIANCE

MATERIAL = "vecrad light"

# Custom property of an object: what its slots were, so that they come back.
KEPT = "vecrad_slots"


def show(objects: Iterable[bpy.types.Object]) -> int:
    """Show the light of the objects that have some; returns their number."""
    lit = [obj for obj in objects if has_light(obj) and not is_shown(obj)]
    for obj in lit:
        kept = {"added": not obj.material_slots}
        if not obj.material_slots:
            obj.data.materials.append(None)
        for index, slot in enumerate(obj.material_slots):
            # Materials of the mesh stay there; those of the object are kept here.
            if slot.link == "OBJECT":
                kept[f"material {index}"] = slot.material
            slot.link = "OBJECT"
            slot.material = light_material()
        obj[KEPT] = kept
    return len(lit)


def hide(objects: Iterable[bpy.types.Object]) -> int:
    """Give objects their own materials back; returns their number."""
    shown = [obj for obj in objects if is_shown(obj)]
    for obj in shown:
        kept = obj[KEPT].to_dict()
        for index, slot in enumerate(obj.material_slots):
            if f"material {index}" in kept:
                slot.material = kept[f"material {index}"]
            else:
                slot.material = None
                slot.link = "DATA"
        if kept["added"]:
            obj.data.materials.clear()
        del obj[KEPT]
    return len(shown)


@contextmanager
def taken_back(objects: list[bpy.types.Object]) -> Iterator[None]:
    """Hide the light for as long as this lasts."""
    shown = [obj for obj in objects if is_shown(obj)]
    hide(shown)
    try:
        yield
    finally:
        show(shown)


def has_light(obj: bpy.types.Object) -> bool:
    """Whether an object is a mesh that was lit, and can be changed."""
    return obj.type == "MESH" and obj.is_editable and RADIANCE in obj.data.attributes


def is_shown(obj: bpy.types.Object) -> bool:
    """Whether the light of an object is shown."""
    return KEPT in obj


def light_material() -> bpy.types.Material:
    """The material that shows the light, made where there is none yet."""
    material = bpy.data.materials.get(MATERIAL)
    if material is not None:
        return material
    material = bpy.data.materials.new(MATERIAL)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    color = nodes.new("ShaderNodeVertexColor")
    color.layer_name = RADIANCE
    color.location = (-400, 0)
    emission = nodes.new("ShaderNodeEmission")
    emission.location = (-200, 0)
    output = nodes.new("ShaderNodeOutputMaterial")
    links.new(color.outputs["Color"], emission.inputs["Color"])
    links.new(emission.outputs["Emission"], output.inputs["Surface"])
    return material

"""The entities of a scene: the directives of its text, carried out."""

from copy import copy
from dataclasses import dataclass, field
from pathlib import Path

import numpy

import transform
from pbrt_file import Directive, Parameters, SceneError, directives

# Targets of `Attribute`, by the directives whose parameters they give.
TARGETS = {
    "Shape": "shape",
    "LightSource": "light",
    "AreaLightSource": "light",
    "Material": "material",
    "MakeNamedMaterial": "material",
    "Texture": "texture",
}
# Directives that change nothing that is converted.
IGNORED = {"Sampler", "PixelFilter", "Accelerator", "Integrator", "Film", "TransformTimes"}


@dataclass
class Entity:
    """The use of a class: its name, its parameters, and the transform to the world."""

    kind: str
    parameters: Parameters
    to_world: transform.Matrix = field(default_factory=lambda: numpy.eye(4))


@dataclass
class Shape(Entity):
    """A shape with its material, or the name of one, and what it emits."""

    material: Entity | str | None = None
    area_light: Entity | None = None
    is_reversed: bool = False


@dataclass
class Instance:
    """A copy of the shapes of an object."""

    name: str
    to_world: transform.Matrix


@dataclass
class State:
    """The graphics state, which blocks save."""

    current: transform.Matrix = field(default_factory=lambda: numpy.eye(4))
    material: Entity | str | None = None
    area_light: Entity | None = None
    is_reversed: bool = False
    # The parameters that `Attribute` gives, by target.
    defaults: dict[str, Parameters] = field(default_factory=dict)
    # False after `ActiveTransform EndTime`: the end of a motion is not converted.
    is_active: bool = True


class PbrtScene:
    """A scene as its file describes it."""

    def __init__(self, path: Path):
        self.path = path
        self.camera: Entity | None = None
        self.shapes: list[Shape] = []
        self.lights: list[Entity] = []
        self.objects: dict[str, list[Shape]] = {}
        self.instances: list[Instance] = []
        self.materials: dict[str, Entity] = {}
        self.textures: dict[str, Entity] = {}
        self.remarks: set[str] = set()
        self.state = State()
        self.saved: list[State] = []
        self.systems: dict[str, transform.Matrix] = {"world": numpy.eye(4)}
        self.open_object: str | None = None
        for directive in directives(path):
            self.execute(directive)

    def execute(self, directive: Directive) -> None:
        if self.change_transform(directive) or directive.name in IGNORED:
            return
        method = getattr(self, f"do_{directive.name}", None)
        if method is None:
            self.remarks.add(f"{directive.name} left out")
        else:
            method(directive)

    def change_transform(self, directive: Directive) -> bool:
        """Carries out a directive that changes the transform alone; false if it is none of them."""
        numbers, current = directive.numbers, self.state.current
        match directive.name:
            case "Identity":
                changed = numpy.eye(4)
            case "Translate":
                changed = current @ transform.translate(numbers)
            case "Scale":
                changed = current @ transform.scale(numbers)
            case "Rotate":
                changed = current @ transform.rotate(numbers[0], numbers[1:])
            case "LookAt":
                changed = current @ transform.look_at(numbers[:3], numbers[3:6], numbers[6:])
            case "Transform":
                changed = transform.from_columns(numbers)
            case "ConcatTransform":
                changed = current @ transform.from_columns(numbers)
            case "CoordSysTransform":
                changed = self.systems.get(directive.texts[0], current)
            case _:
                return False
        if self.state.is_active:
            self.state.current = changed
        return True

    def do_ActiveTransform(self, directive: Directive) -> None:
        self.state.is_active = directive.texts[0] != "EndTime"
        if not self.state.is_active:
            self.remarks.add("motion left out")

    def do_CoordinateSystem(self, directive: Directive) -> None:
        self.systems[directive.texts[0]] = self.state.current

    def do_ReverseOrientation(self, _: Directive) -> None:
        self.state.is_reversed = not self.state.is_reversed

    def do_WorldBegin(self, _: Directive) -> None:
        self.state = State(defaults=self.state.defaults)

    def do_AttributeBegin(self, _: Directive) -> None:
        self.saved.append(copy(self.state))

    def do_AttributeEnd(self, directive: Directive) -> None:
        if not self.saved:
            raise SceneError(f"{directive.file}: `AttributeEnd` without its `AttributeBegin`")
        self.state = self.saved.pop()

    def do_TransformBegin(self, directive: Directive) -> None:
        self.do_AttributeBegin(directive)

    def do_TransformEnd(self, directive: Directive) -> None:
        changed = self.state
        self.do_AttributeEnd(directive)
        changed.current = self.state.current
        self.state = changed

    def do_ObjectBegin(self, directive: Directive) -> None:
        self.do_AttributeBegin(directive)
        self.open_object = directive.texts[0]
        self.objects[self.open_object] = []

    def do_ObjectEnd(self, directive: Directive) -> None:
        self.do_AttributeEnd(directive)
        self.open_object = None

    def do_ObjectInstance(self, directive: Directive) -> None:
        self.instances.append(Instance(directive.texts[0], self.state.current))

    def do_ColorSpace(self, directive: Directive) -> None:
        if directive.texts[0] != "srgb":
            self.remarks.add(f"colour space {directive.texts[0]} taken as sRGB")

    def do_Option(self, _: Directive) -> None:
        pass

    def do_MediumInterface(self, directive: Directive) -> None:
        if any(directive.texts):
            self.remarks.add("media left out")

    def do_MakeNamedMedium(self, _: Directive) -> None:
        self.remarks.add("media left out")

    def do_Attribute(self, directive: Directive) -> None:
        target = directive.texts[0]
        earlier = self.state.defaults.get(target, {})
        merged = Parameters({**earlier, **directive.parameters})
        self.state.defaults = {**self.state.defaults, target: merged}

    def entity(self, directive: Directive, kind: str) -> Entity:
        given = self.state.defaults.get(TARGETS.get(directive.name, ""), {})
        parameters = Parameters({**given, **directive.parameters})
        return Entity(kind, parameters, self.state.current)

    def do_Camera(self, directive: Directive) -> None:
        self.camera = self.entity(directive, directive.texts[0])
        self.camera.to_world = numpy.linalg.inv(self.state.current)
        self.systems["camera"] = self.camera.to_world

    def do_Material(self, directive: Directive) -> None:
        self.state.material = self.entity(directive, directive.texts[0])

    def do_MakeNamedMaterial(self, directive: Directive) -> None:
        kind = directive.parameters.text("type")
        self.materials[directive.texts[0]] = self.entity(directive, kind)

    def do_NamedMaterial(self, directive: Directive) -> None:
        self.state.material = directive.texts[0]

    def do_Texture(self, directive: Directive) -> None:
        name, _, kind = directive.texts
        self.textures[name] = self.entity(directive, kind)

    def do_AreaLightSource(self, directive: Directive) -> None:
        self.state.area_light = self.entity(directive, directive.texts[0])

    def do_LightSource(self, directive: Directive) -> None:
        self.lights.append(self.entity(directive, directive.texts[0]))

    def do_Shape(self, directive: Directive) -> None:
        found = self.entity(directive, directive.texts[0])
        state = self.state
        shape = Shape(
            found.kind,
            found.parameters,
            found.to_world,
            state.material,
            state.area_light,
            state.is_reversed,
        )
        is_part = self.open_object is not None
        (self.objects[self.open_object] if is_part else self.shapes).append(shape)

"""Sliders for parameters in notebooks; ``pip install 'rtsl[notebook]'`` brings what they need."""

from __future__ import annotations

import time
from typing import Any, Callable, Dict, List, Optional, Tuple, Union

import numpy as np

from ._instance import Instance
from ._scene import Placed, Scene, Thing

#: The ends of sliders of parameters without a range.
_USUAL_RANGE = (0.0, 10.0)

Subject = Union[Scene, Thing, Placed, Instance]


def sliders(
    subject: Subject,
    *,
    scene: Optional[Scene] = None,
    on_change: Optional[Callable[[], Any]] = None,
    **render: Any,
) -> Any:
    """Returns widgets that set the parameters of an instance, of a part of a scene, or of all its parts.

    Ranges, labels and descriptions are those of the annotations. A scene is rendered again at each change, with the
    keywords of `Scene.render`, at first 4 samples of a pixel and 400 by 300 pixels. ``on_change`` is called after a
    change. Nothing is compiled.
    """
    try:
        import ipywidgets
    except ImportError as error:
        raise ImportError("sliders need ipywidgets: `pip install 'rtsl[notebook]'`") from error

    scene = subject if isinstance(subject, Scene) else scene
    picture = ipywidgets.Image(format="png") if scene is not None else None
    status = ipywidgets.Label()
    options = {"spp": 4, "size": (400, 300), "progress": False, **render}

    def show() -> None:
        if scene is not None and picture is not None:
            start = time.monotonic()
            picture.value = scene.render(**options).png()
            status.value = f"{time.monotonic() - start:.2f} s"
        if on_change is not None:
            on_change()

    def changed(target: Any, control: Dict[str, Any], value: Any) -> None:
        try:
            setattr(target, control["name"], value)
        except Exception as error:  # Shown where the user looks: a kernel writes those of widgets to its log.
            status.value = str(error).splitlines()[0]
        else:
            show()

    boxes, titles = [], []
    for title, target, controls in _targets(subject):
        widgets = [_widget(ipywidgets, target, control, changed) for control in controls]
        if widgets:
            boxes.append(ipywidgets.VBox(widgets))
            titles.append(title)
    panel = boxes[0] if len(boxes) == 1 else ipywidgets.Accordion(boxes, titles=titles)
    if scene is not None:
        show()
    return ipywidgets.VBox([it for it in (panel, picture, status) if it is not None])


def controls_of(instance: Instance) -> List[Dict[str, Any]]:
    """Returns the parameters of an instance that widgets can set, in the form of those of `Thing.controls`."""
    controls = []
    for parameter in instance._class.parameters.values():
        kind = _kind(parameter.type)
        value = instance[parameter.name]
        if kind is None or isinstance(value, (Instance, list)) or value is None:
            continue
        if isinstance(value, str):
            value = dict(parameter.choices)[value]
        controls.append(
            {
                "name": parameter.name,
                "label": parameter.label,
                "doc": parameter.doc or None,
                "unit": parameter.unit,
                "kind": kind,
                "min": parameter.min,
                "max": parameter.max,
                "choices": parameter.choices,
                "values": [float(it) for it in np.ravel(value)],
            }
        )
    return controls


def _kind(type_name: str) -> Optional[str]:
    name = type_name.removeprefix("texture ")
    if name == "color":
        return "color"
    if name in ("float", "vec2", "vec3", "vec4"):
        return "real"
    if name in ("int", "uint", "ivec2", "ivec3", "ivec4", "uvec2", "uvec3", "uvec4"):
        return "whole"
    return "truth" if name == "bool" else None


def _targets(subject: Subject) -> List[Tuple[str, Any, List[Dict[str, Any]]]]:
    """Returns titles, the objects whose attributes are set, and their controls."""
    if isinstance(subject, Instance):
        return [(subject._class.name, subject, controls_of(subject))]
    if isinstance(subject, Thing):
        return [(subject.title, subject, list(subject.controls.values()))]
    if isinstance(subject, Placed):
        parts = [subject.instance, subject.material, subject.emission]
        return [target for part in parts if part is not None for target in _targets(part)]
    targets = [target for thing in subject.things for target in _targets(thing)]
    placed = [*([subject.camera] if subject.camera is not None else []), *subject.placed]
    seen = set()
    for it in placed:
        for title, target, controls in _targets(it):
            if id(target) not in seen:
                seen.add(id(target))
                targets.append((f"{it.name}: {title}" if it.name else title, target, controls))
    return targets


def _widget(ipywidgets: Any, target: Any, control: Dict[str, Any], changed: Callable[..., None]) -> Any:
    """Returns the widget of a control."""
    kind, values = control["kind"], control["values"]
    unit = f" ({control['unit']})" if control["unit"] else ""
    common = {"description": control["label"] + unit, "style": {"description_width": "12em"}}
    if control["doc"]:
        common["tooltip"] = control["doc"]
    if control["choices"]:
        made = ipywidgets.Dropdown(options=[(name, name) for name, _ in control["choices"]], **common)
        made.value = next(name for name, number in control["choices"] if number == values[0])
    elif kind == "truth" and len(values) == 1:
        made = ipywidgets.Checkbox(value=bool(values[0]), **common)
    elif kind == "color":
        made = ipywidgets.ColorPicker(value=_hex(values), **common)
    elif len(values) == 1:
        made = _slider(ipywidgets, control, values[0], common)
    else:
        return _vector(ipywidgets, target, control, changed, common)
    convert = _rgb if kind == "color" else (lambda value: value)
    made.observe(lambda change: changed(target, control, convert(change["new"])), names="value")
    return made


def _slider(ipywidgets: Any, control: Dict[str, Any], value: float, common: Dict[str, Any]) -> Any:
    low = control["min"] if control["min"] is not None else min(_USUAL_RANGE[0], 2 * value)
    high = control["max"] if control["max"] is not None else max(_USUAL_RANGE[1], 2 * value, low + 1)
    # The scene may give a value outside of the range, which the slider is not to change.
    low, high = min(low, value), max(high, value)
    if control["kind"] == "whole":
        return ipywidgets.IntSlider(
            value=int(value), min=int(low), max=int(high), continuous_update=False, **common
        )
    step = (high - low) / 200
    return ipywidgets.FloatSlider(
        value=value, min=low, max=high, step=step, readout_format=".3g", continuous_update=False, **common
    )


def _vector(
    ipywidgets: Any, target: Any, control: Dict[str, Any], changed: Callable[..., None], common: Dict[str, Any]
) -> Any:
    parts = [ipywidgets.FloatText(value=it, layout={"width": "7em"}) for it in control["values"]]
    label = ipywidgets.Label(common["description"], layout={"width": "12em"})

    def set_all(_: Any) -> None:
        numbers = [part.value for part in parts]
        changed(target, control, [int(it) for it in numbers] if control["kind"] == "whole" else numbers)

    for part in parts:
        part.observe(set_all, names="value")
    return ipywidgets.HBox([label, *parts])


def _hex(linear: List[float]) -> str:
    """Returns a linear colour as `#rrggbb`."""
    clipped = np.clip(linear, 0, 1)
    encoded = np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)
    return "#" + "".join(f"{int(round(255 * it)):02x}" for it in encoded)


def _rgb(text: str) -> List[float]:
    """Returns the linear colour of `#rrggbb`."""
    encoded = np.array([int(text[1 + 2 * it : 3 + 2 * it], 16) / 255 for it in range(3)])
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return [float(it) for it in linear]

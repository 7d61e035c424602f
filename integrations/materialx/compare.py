#!/usr/bin/env python3
"""Compares the values of MaterialX documents in RTSL with those of the GLSL that MaterialX generates.

`rtsl materialx --outputs` translates the outputs of the graphs in documents to textures. MaterialX generates a shader in
GLSL for each of them, which RTSL compiles in a texture of its own. Both are evaluated by `rtsl eval` at the same random
points. Outputs whose shaders read images, take differences of pixels or need data that this host lacks are counted as
not compared.

The Python package of MaterialX is needed: `python3 -m pip install MaterialX==1.39.5`. It has the definitions of the
standard nodes; documents are those of the repository of MaterialX (`resources/Materials`) or others.

The exit status is 0 if all outputs that can be compared agree, 1 if some differ, and 2 if nothing can be compared.
"""

import argparse
import json
import math
import random
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

try:
    import MaterialX as mx
    import MaterialX.PyMaterialXGenGlsl as mx_glsl
    import MaterialX.PyMaterialXGenShader as mx_shader
except ImportError:
    mx = None

# The types of outputs, and the number of their components.
TYPES = {
    "boolean": 1, "integer": 1, "float": 1, "vector2": 2, "vector3": 3, "color3": 3, "vector4": 4, "color4": 4,
}

# The values of uniform variables without one of their own.
ZEROS = {
    "float": "0.0", "int": "0", "bool": "false", "vec2": "vec2(0.0)", "vec3": "vec3(0.0)", "vec4": "vec4(0.0)",
    "mat3": "mat3(1.0)", "mat4": "mat4(1.0)",
}

# The expressions of a texture for the data that vertices have in generated shaders.
TANGENT = "makeFrame(rt_ShadingNormal, rt_dPdu)[0]"
BITANGENT = "bitangentHere(rt_ShadingNormal, rt_dPdu, rt_dPdv)"
VERTEX_DATA = {
    "texcoord_0": "rt_TextureUV",
    "positionWorld": "rt_HitPoint",
    "positionObject": "rt_HitPoint",
    "normalWorld": "rt_ShadingNormal",
    "normalObject": "rt_ShadingNormal",
    "tangentWorld": TANGENT,
    "tangentObject": TANGENT,
    "bitangentWorld": BITANGENT,
    "bitangentObject": BITANGENT,
    "color_0": "vec4(1.0)",
}

BITANGENT_FUNCTION = """vec3 bitangentHere(vec3 normal, vec3 u, vec3 v) {
    vec3 side = makeFrame(normal, u)[1];
    return dot(side, v) < 0.0 ? -side : side;
}
"""


class NotCompared(Exception):
    """An output that cannot be compared, with the reason."""


class Generator:
    """The generator of GLSL, with MaterialX's definitions."""

    def __init__(self, data):
        self.path = mx.getDefaultDataSearchPath() if data is None else mx.FileSearchPath(str(data))
        self.library = mx.createDocument()
        mx.loadLibraries(mx.getDefaultDataLibraryFolders(), self.path, self.library)
        self.generator = mx_glsl.GlslShaderGenerator.create()
        target = self.generator.getTarget()
        colors = mx_shader.DefaultColorManagementSystem.create(target)
        colors.loadLibrary(self.library)
        self.generator.setColorManagementSystem(colors)
        units = mx_shader.UnitSystem.create(target)
        units.loadLibrary(self.library)
        registry = mx.UnitConverterRegistry.create()
        for name in ("distance", "angle"):
            definition = self.library.getUnitTypeDef(name)
            registry.addUnitConverter(definition, mx.LinearUnitConverter.create(definition))
        units.setUnitConverterRegistry(registry)
        self.generator.setUnitSystem(units)

    def glsl(self, output):
        """Returns the generated shader of an output."""
        context = mx_shader.GenContext(self.generator)
        context.registerSourceCodeSearchPath(self.path)
        context.getOptions().targetColorSpaceOverride = "lin_rec709"
        try:
            return self.generator.generate("compared", output, context).getSourceCode("pixel")
        except Exception as error:
            raise NotCompared(f"MaterialX generates no shader: {error}") from error


def outputs_of(document):
    """Returns the outputs of values, in the order in which RTSL translates them."""
    root = [it for it in document.getChildren() if it.getCategory() == "output"]
    graphs = [it for it in document.getNodeGraphs() if not it.getAttribute("nodedef")]
    inner = [it for graph in graphs for it in graph.getChildren() if it.getCategory() == "output"]
    return [(it.getNamePath(), it.getType()) for it in root + inner if it.getType() in TYPES]


def texture_of(glsl):
    """Returns a texture of RTSL that computes what a generated shader does."""
    text = re.sub(r"/\*.*?\*/", "", glsl, flags=re.S)
    text = re.sub(r"#version.*", "", text)
    if "sampler2D" in text:
        raise NotCompared("images")
    if re.search(r"\bdFd[xy]\(", text):
        raise NotCompared("differences of pixels")
    block = re.search(r"in VertexData\s*\{(.*?)\}\s*vd;", text, flags=re.S)
    data = block.group(1) if block else ""
    if block:
        text = text.replace(block.group(0), "")
    result = re.search(r"out vec4 (\w+);", text)
    text = text.replace(result.group(0), "")
    text = re.sub(r"uniform (\w+) (\w+)(?:\[\d+\])?(?:\s*=\s*([^;]+))?;", constant_of, text)
    head, main = text.split("void main()")
    body = main[main.index("{") + 1 : main.rindex("}")]
    structure = f"struct VertexData {{ {data} }};\n" if block else ""
    return (
        f"{BITANGENT_FUNCTION}{head}{structure}class Generated : rt_Texture;\n"
        f"void lookup() {{\n    vec4 {result.group(1)} = vec4(0.0);\n{members_of(data)}{body}"
        f"    rt_TextureColor = color({result.group(1)}.xyz);\n    rt_FloatTextureValue = {result.group(1)}.w;\n}}\n"
    )


def constant_of(uniform):
    """Returns the declaration of a constant with the value of a uniform variable."""
    kind, name, value = uniform.groups()
    if name == "u_frame":
        value = "1.0"
    return f"const {kind} {name} = {(value or ZEROS.get(kind, '0.0')).strip()};"


def members_of(data):
    """Returns the statements that set the data of vertices."""
    statements = ["    VertexData vd;\n"] if data.strip() else []
    for _, name in re.findall(r"(\w+) (\w+);", data):
        if name not in VERTEX_DATA:
            raise NotCompared(f"data of vertices: {name}")
        statements.append(f"    vd.{name} = {VERTEX_DATA[name]};\n")
    return "".join(statements)


def random_points(count, seed):
    """Returns the state of a texture at random points."""
    numbers = random.Random(seed)

    def lanes(make):
        return {"lanes": [make() for _ in range(count)]}

    def vector():
        return [numbers.gauss(0, 1) for _ in range(3)]

    def direction():
        parts = vector()
        length = math.sqrt(sum(part * part for part in parts))
        return [part / length for part in parts]

    points = lanes(lambda: [numbers.uniform(-2, 2) for _ in range(3)])
    normals = lanes(direction)
    return {
        "rt_TextureUV": lanes(lambda: [numbers.random(), numbers.random()]),
        "rt_HitPoint": points,
        "rt_RayDirection": points,
        "rt_ShadingNormal": normals,
        "rt_GeometricNormal": normals,
        "rt_dPdu": lanes(vector),
        "rt_dPdv": lanes(vector),
    }


class Rtsl:
    """The command `rtsl`."""

    def __init__(self, command, state):
        self.command = command
        self.state = state

    def textures(self, path):
        """Returns the text of the outputs of a document, and the names of its textures."""
        ran = subprocess.run([self.command, "materialx", str(path), "--outputs"], capture_output=True, text=True)
        if ran.returncode:
            raise NotCompared("RTSL translates no such document: " + ran.stderr.split("\n")[0])
        return ran.stdout, re.findall(r"^class (\w+) : rt_Texture;", ran.stdout, flags=re.M)

    def values(self, textures):
        """Returns the components of textures at all points; each is a text and a class."""
        requests = [
            {"id": i, "source": text, "class": name, "method": "lookup", "state": self.state, "backend": "interp"}
            for i, (text, name) in enumerate(textures)
        ]
        lines = "".join(json.dumps(it) + "\n" for it in requests)
        ran = subprocess.run([self.command, "eval", "--stdin"], input=lines, capture_output=True, text=True)
        answers = [json.loads(line) for line in ran.stdout.splitlines()]
        if len(answers) != len(textures):
            raise NotCompared("rtsl eval: " + (ran.stderr.strip().split("\n") or [""])[0])
        return [self.components(answer) for answer in answers]

    def components(self, answer):
        """Returns the colour and the number of an answer at all points."""
        if not answer.get("ok"):
            errors = [it["message"] for it in answer.get("diagnostics", []) if it["severity"] == "error"]
            raise NotCompared("RTSL refuses a shader: " + (errors or [str(answer.get("error"))])[0])
        colors, values = (answer["state"][it]["lanes"] for it in ("rt_TextureColor", "rt_FloatTextureValue"))
        pairs = zip(colors, values)
        return [[number(it) for it in [*color, value]] for color, value in pairs]


def number(value):
    """Returns a number of an answer; those that are not finite are texts."""
    return float(value.replace("Infinity", "inf")) if isinstance(value, str) else float(value)


def worst_error(own, generated, kind):
    """Returns the greatest relative error of an output of this type at any point."""
    # A texture's number is a colour of generated shaders.
    chosen = {1: ([3], [0]), 2: ([0, 1], [0, 1]), 3: ([0, 1, 2], [0, 1, 2])}
    places = chosen.get(TYPES[kind], ([0, 1, 2, 3], [0, 1, 2, 3]))
    errors = [
        error(a[i], b[j]) for a, b in zip(own, generated) for i, j in zip(*places)
    ]
    return max(errors)


def error(own, generated):
    """Returns the error relative to values above 1. Two values that are no numbers agree."""
    if own == generated or (math.isnan(own) and math.isnan(generated)):
        return 0.0
    difference = abs(own - generated) / max(1.0, abs(generated))
    return math.inf if math.isnan(difference) else difference


def compare_document(path, generator, rtsl, tolerance, counts):
    """Compares the outputs of a document, and yields those that differ with their errors."""
    document = mx.createDocument()
    try:
        mx.readFromXmlFile(document, str(path), mx.FileSearchPath(str(path.parent)))
    except Exception as problem:
        counts[f"MaterialX reads no such document: {problem}"] += 1
        return
    outputs = outputs_of(document)
    if not outputs:
        return
    document.importLibrary(generator.library)
    try:
        text, classes = rtsl.textures(path)
        if len(classes) != len(outputs):
            raise NotCompared("RTSL finds other outputs")
    except NotCompared as reason:
        counts[str(reason)] += len(outputs)
        return
    for (name, kind), own in zip(outputs, classes):
        try:
            generated = texture_of(generator.glsl(document.getDescendant(name)))
            values = rtsl.values([(text, own), (generated, "Generated")])
        except NotCompared as reason:
            counts[str(reason)] += 1
            continue
        found = worst_error(*values, kind)
        counts["agree" if found <= tolerance else "differ"] += 1
        if found > tolerance:
            yield name, found


def documents_in(paths):
    """Yields the documents of folders, and others."""
    for path in paths:
        yield from sorted(path.rglob("*.mtlx")) if path.is_dir() else [path]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="+", type=Path, metavar="PATH", help="a document, or a folder of documents")
    parser.add_argument("--rtsl", default="rtsl", help="the command (default: rtsl)")
    parser.add_argument("--data", type=Path, help="the folder with MaterialX's libraries (default: the package's)")
    parser.add_argument("--points", type=int, default=128, help="points for each output (default: 128)")
    parser.add_argument("--seed", type=int, default=7, help="seed of the points (default: 7)")
    parser.add_argument("--tolerance", type=float, default=1e-4, help="greatest relative error (default: 0.0001)")
    return parser.parse_args()


def main():
    options = arguments()
    if mx is None:
        print("the package MaterialX is missing: python3 -m pip install MaterialX==1.39.5", file=sys.stderr)
        return 2
    missing = [str(path) for path in options.paths if not path.exists()]
    if missing:
        print(f"there is no {missing[0]}", file=sys.stderr)
        return 2
    generator = Generator(options.data)
    rtsl = Rtsl(options.rtsl, random_points(options.points, options.seed))
    counts = Counter()
    for path in documents_in(options.paths):
        for name, found in compare_document(path, generator, rtsl, options.tolerance, counts):
            print(f"{path}: {name} differs by {found:.2g}", flush=True)
    agree, differ = counts.pop("agree", 0), counts.pop("differ", 0)
    print(f"{agree} of {agree + differ} outputs agree to {options.tolerance:g}, MaterialX {mx.getVersionString()}")
    for reason, count in counts.most_common():
        print(f"not compared: {count} ({reason})")
    if agree + differ == 0:
        return 2
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())

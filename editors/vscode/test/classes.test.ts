import assert from "node:assert/strict";
import test from "node:test";

import { classAt, declaredClasses, methodAt, previewParameters } from "../src/classes";

const TEXT = `// class Commented : rt_Texture;
/*
class Hidden;
*/
const float PI = 3.0;
float half(float x) { return 0.5 * x; }

/// A ball.
// preview: "float radius" 2
//   preview: "rgb kd" [1 0 0]
class Ball : rt_Primitive;
public float radius = 1.0;

void intersect()
{
    if (radius > 0.0) {
        float t = half(1.0);
        hit(t);
    }
}
float prototype(float x);
vec3[2] corners(
    float x,
    float y) {
    return vec3[2](vec3(x), vec3(y));
}

class Grey : rt_Texture {
    void lookup() { rt_FloatTextureValue = 0.5; } // class Trailing;
    uniform float a = length(vec3(1.0));
};
`;
const line = (part: string) => TEXT.slice(0, TEXT.indexOf(part)).split("\n").length - 1;

test("comments declare no classes", () => {
    assert.deepEqual(
        declaredClasses(TEXT).map((each) => each.name),
        ["Ball", "Grey"],
    );
});

test("the class at the cursor is the last one that begins before", () => {
    assert.equal(classAt(TEXT, 0)?.name, "Ball");
    assert.equal(classAt(TEXT, line("half(1.0)"))?.name, "Ball");
    assert.equal(classAt(TEXT, line("void lookup"))?.name, "Grey");
    assert.equal(classAt(TEXT, 1000)?.name, "Grey");
    assert.equal(classAt("float x;", 0), undefined);
});

test("the comment before a class belongs to it", () => {
    const text = "class A : rt_Texture;\nfloat x;\n\n/// B.\nclass B : rt_Texture;\n";
    assert.equal(classAt(text, 2)?.name, "A");
    assert.equal(classAt(text, 3)?.name, "B");
});

test("the method at the cursor is that whose head or body has the line", () => {
    assert.equal(methodAt(TEXT, line("void intersect")), "intersect");
    assert.equal(methodAt(TEXT, line("hit(t)")), "intersect");
    assert.equal(methodAt(TEXT, line("float y)")), "corners");
    assert.equal(methodAt(TEXT, line("return vec3")), "corners");
    assert.equal(methodAt(TEXT, line("void lookup")), "lookup");
    assert.equal(methodAt(TEXT, line("float half")), "half");
});

test("outside methods there is none", () => {
    for (const part of ["public float radius", "float prototype", "class Ball", "uniform float a", "};"]) {
        assert.equal(methodAt(TEXT, line(part)), undefined, part);
    }
});

test("comments set parameters of previews", () => {
    const [ball, grey] = declaredClasses(TEXT);
    assert.equal(previewParameters(TEXT, ball), '"float radius" 2 "rgb kd" [1 0 0]');
    assert.equal(previewParameters(TEXT, grey), "");
});

//! The style, by examples.

use expect_test::{Expect, expect};

use super::{error_of, formatted};

fn check(text: &str, expected: Expect) {
    expected.assert_eq(&formatted(text));
}

#[test]
fn declarations() {
    check(
        "// A file.
#define   TWICE( x )   ( 2.0*x )
#if defined(A)
import optics.fresnel ;
#endif


enum   Kind{Plain,Fancy=4};
enum Long {
First, Second = 2, // two
Third };
struct Medium{float inside,outside;} air;
struct Point {
vec3 at; // place
float weight;   // what it counts
};
/// Doc.
class  Grey:rt_Texture , Other{
float rows[4] = {1.0,2.0,
3.0,4.0};

void lookup( ) ;
float f(const  in float[2] x,out vec3 y){return x[0];}
constructor(){}
};
",
        expect![[r#"
            // A file.
            #define   TWICE( x )   ( 2.0*x )
            #if defined(A)
            import optics.fresnel;
            #endif

            enum Kind { Plain, Fancy = 4 };
            enum Long {
                First,
                Second = 2, // two
                Third
            };
            struct Medium { float inside, outside; } air;
            struct Point {
                vec3 at;      // place
                float weight; // what it counts
            };
            /// Doc.
            class Grey : rt_Texture, Other {
                float rows[4] = { 1.0, 2.0, 3.0, 4.0 };

                void lookup();
                float f(const in float[2] x, out vec3 y) { return x[0]; }
                constructor() {}
            };
        "#]],
    );
}

#[test]
fn annotations() {
    check(
        r#"class A:rt_Texture;
[[min 0,max -1,doc "x"]]public  float value=0.5 ;
[[doc "Longer."]]
public  float other;
[[doc "Longer."]] public  float third;
[[ label "A long label", doc "A long documentation comment that makes the whole declaration too long for one line" ]] public texture color tint = color(0.5);
constructor([[min 0, doc "Scales the radiance, too: renderers make the illuminance that of the scene."]] float gain = 1.0) { }
"#,
        expect![[r#"
            class A : rt_Texture;
            [[min 0, max -1, doc "x"]] public float value = 0.5;
            [[doc "Longer."]]
            public float other;
            [[doc "Longer."]] public float third;
            [[label "A long label", doc "A long documentation comment that makes the whole declaration too long for one line"]]
            public texture color tint = color(0.5);
            constructor(
                    [[min 0, doc "Scales the radiance, too: renderers make the illuminance that of the scene."]]
                    float gain = 1.0) {}
        "#]],
    );
}

#[test]
fn statements() {
    check(
        "void f() {
/* first */ float a=- -x+ +y, b=!c ? -1.0:2.0;
if(a>0.0)return; else b++;
if (a) { b = 1.0; } else if (c) { b = 2.0; } else { b = 3.0; }
if (a)
{
b = 1.0; } // done
else { }
for(int i=0;i<4;++i){sum+=i ;}
for (;;) break;
while(true)
    a--;
do { a -= 1.0; } while (a > 0.0) ;
switch(int(a)){case 0:case 1:a=1.0;break;
case 2:
a=2.0;
default:{ a = 4.0; }
}
illuminance(P,N,1.5){ sum += rt_LightColor ; }
print(\"a = {}\",a) ;
NOTE(a)
return a[1][2].xyz+f(x)(y)
  // why
  +z;


}
",
        expect![[r#"
            void f() {
                /* first */ float a = - -x + +y, b = !c ? -1.0 : 2.0;
                if (a > 0.0) return; else b++;
                if (a) { b = 1.0; } else if (c) { b = 2.0; } else { b = 3.0; }
                if (a) {
                    b = 1.0;
                } // done
                else {}
                for (int i = 0; i < 4; ++i) { sum += i; }
                for (;;) break;
                while (true)
                    a--;
                do {
                    a -= 1.0;
                } while (a > 0.0);
                switch (int(a)) {
                case 0:
                case 1: a = 1.0; break;
                case 2:
                    a = 2.0;
                default: { a = 4.0; }
                }
                illuminance(P, N, 1.5) { sum += rt_LightColor; }
                print("a = {}", a);
                NOTE(a)
                return a[1][2].xyz + f(x)(y)
                    // why
                    + z;
            }
        "#]],
    );
}

#[test]
fn long_statements() {
    check(
        "void f() {
rt_BSDFValue = weight(of.normal) * base.BSDF(rt_ShadingNormal = of.normal, rt_GeometricNormal = of.normal, rt_dPdu = of.along, rt_dPdv = of.across);
float seen = thin ? facetsPDF(view, above, at.alpha) : ggxDensity(facet.xyz, at.alpha) * facet.w / ((1.0 + smithLambda(view, at.alpha)) * view.z);
return vec2(dot(haze, vec3(dot(powers, vec4(0.00166, -0.00375, 0.00209, 0.0)), dot(powers, vec4(-0.02903, 0.06377, -0.03202, 0.00394)))), 1.0);
const float TABLE[]=float[](1.0,2.0,3.0,4.0,5.0,6.0,7.0,8.0,
9.0,10.0,11.0,12.0,13.0,14.0,15.0,16.0,17.0,18.0,19.0,20.0,21.0,22.0,23.0,24.0,25.0,26.0,27.0,28.0,29.0);
return log(1.0 + y * (3.5156229 + y * (3.0899424 + y * (1.2067492 + y * (0.2659732 + y * (0.0360768 + y * (0.0045813 + y)))))));
}
vec3 corrected(vec3 rgb, float hue, float saturation, float gamma, float lift, float gain, float contrast, float pivot, float exposure) {
return rgb;
}
",
        expect![[r#"
            void f() {
                rt_BSDFValue = weight(of.normal) * base.BSDF(
                    rt_ShadingNormal = of.normal, rt_GeometricNormal = of.normal, rt_dPdu = of.along, rt_dPdv = of.across);
                float seen = thin
                    ? facetsPDF(view, above, at.alpha)
                    : ggxDensity(facet.xyz, at.alpha) * facet.w / ((1.0 + smithLambda(view, at.alpha)) * view.z);
                return vec2(
                    dot(haze, vec3(
                        dot(powers, vec4(0.00166, -0.00375, 0.00209, 0.0)),
                        dot(powers, vec4(-0.02903, 0.06377, -0.03202, 0.00394)))),
                    1.0);
                const float TABLE[] = float[](
                    1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0,
                    9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0, 17.0, 18.0, 19.0, 20.0, 21.0, 22.0, 23.0, 24.0, 25.0, 26.0, 27.0,
                    28.0, 29.0);
                return log(1.0 + y
                    * (3.5156229 + y * (3.0899424 + y * (1.2067492 + y * (0.2659732 + y * (0.0360768 + y * (0.0045813 + y)))))));
            }
            vec3 corrected(
                    vec3 rgb, float hue, float saturation, float gamma, float lift, float gain, float contrast, float pivot,
                    float exposure) {
                return rgb;
            }
        "#]],
    );
}

#[test]
fn branches_of_the_preprocessor() {
    check(
        "float f(float x){
#ifdef A
if (x > 0.0) {
  x = 1.0;
}
  #else
x = 2.0;
#endif
return x
#ifdef A
+ 1.0
#endif
;
}
",
        expect![[r#"
            float f(float x) {
            #ifdef A
                if (x > 0.0) {
                    x = 1.0;
                }
            #else
                x = 2.0;
            #endif
                return x
            #ifdef A
                    + 1.0
            #endif
                    ;
            }
        "#]],
    );
}

#[test]
fn refused_texts() {
    let errors = [
        "float f( {",
        "float f)",
        "float x = \"a;\n",
        "/* a",
        "float é;",
        "#if A\n{\n#else\n#endif\n}\n",
    ];
    let errors: Vec<String> = errors.iter().map(|text| error_of(text)).collect();
    expect![[r#"
        error[E0102]: `{` without its pair
          ┌─ test.rtsl:1:10
          │
        1 │ float f( {
          │          ^ never closed


        error[E0102]: `)` without its pair
          ┌─ test.rtsl:1:8
          │
        1 │ float f)
          │        ^ closes nothing


        error[E0004]: text without its closing quotation mark
          ┌─ test.rtsl:1:11
          │
        1 │ float x = "a;
          │           ^^^ begins here
          │
          = help: add the mark: `"`


        error[E0003]: a comment that never ends
          ┌─ test.rtsl:1:1
          │
        1 │ /* a
          │ ^^ begins here
          │
          = note: comments do not nest: the first `*/` ends a comment


        error[E0002]: `é` is not ASCII
          ┌─ test.rtsl:1:7
          │
        1 │ float é;
          │       ^ outside a comment
          │
          = note: names are ASCII as in GLSL; other characters may appear in comments and in the text of annotations


        error[E0628]: a branch of `#if` in which brackets do not pair
          ┌─ test.rtsl:2:1
          │
        2 │ {
          │ ^ the branch ends after this
          │
          = help: let each branch contain whole statements or declarations

    "#]].assert_eq(&errors.join("\n"));
}

#[test]
fn nesting_beyond_the_limit_is_refused() {
    for (open, close) in [("(", ")"), ("if (a) ", ";"), ("a ? b : ", ""), ("a = ", "")] {
        let text =
            format!("{}{}", open.repeat(5000), close.repeat(if close == ")" { 5000 } else { 1 }));
        assert!(error_of(&text).contains("E0104"), "{open}");
    }
}

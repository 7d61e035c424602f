// The scenes of previews: for each role a studio that shows a class of it.

export const ROLES = ["material", "texture", "primitive", "light", "camera", "integrator"] as const;
export type Role = (typeof ROLES)[number];

/** A box with edges along the axes. */
export interface Bounds {
    low: [number, number, number];
    high: [number, number, number];
}

/** What a preview shows. */
export interface Subject {
    /** The name of the class. */
    name: string;
    role: Role;
    /** Parameters of the instance, in the format of scenes. */
    parameters: string;
    /** The bounds of a primitive; none if it has no method for them or they are not finite. */
    bounds?: Bounds;
}

/** Width and height of a picture in pixels, and samples for each. */
export interface Quality {
    width: number;
    height: number;
    samples: number;
}

/** The height to which the studio scales primitives. */
const SIZE = 2;

const SKY = 'LightSource "infinite" "rgb L" [0.42 0.46 0.52]';

const LAMP = `AttributeBegin
  AreaLightSource "diffuse" "rgb L" [28 26 23]
  Translate -3.5 5.5 -4
  Shape "Sphere" "float radius" 1
AttributeEnd`;

const FLOOR = `Texture "studio floor" "spectrum" "checkerboard" "float uscale" 1 "float vscale" 1
  "rgb tex1" [0.4 0.4 0.42] "rgb tex2" [0.25 0.25 0.27]
Material "diffuse" "texture reflectance" "studio floor"
Shape "Plane"`;

const SHAPES = `AttributeBegin
  Translate -0.75 1 0.3
  Shape "Sphere" "float radius" 1
AttributeEnd
AttributeBegin
  Translate 0.95 0.55 -0.5
  Rotate 28 0 1 0
  Shape "Box" "point3 corner" [-0.55 -0.55 -0.55] "point3 opposite" [0.55 0.55 0.55]
AttributeEnd`;

const STILL_LIFE = `AttributeBegin
  Material "coateddiffuse" "rgb reflectance" [0.62 0.1 0.07] "float roughness" 0.1
  Translate -1.15 0.85 0.5
  Shape "Sphere" "float radius" 0.85
AttributeEnd
AttributeBegin
  Material "conductor" "spectrum eta" "metal-Cu-eta" "spectrum k" "metal-Cu-k" "float roughness" 0.15
  Translate 1.15 0.3 0
  Shape "Torus" "float majorRadius" 0.75 "float minorRadius" 0.3
AttributeEnd
AttributeBegin
  Material "diffuse" "rgb reflectance" [0.15 0.35 0.6]
  Translate 0 0.4 -0.9
  Rotate 30 0 1 0
  Shape "Box" "point3 corner" [-0.4 -0.4 -0.4] "point3 opposite" [0.4 0.4 0.4]
AttributeEnd`;

const LOOK_AT = "LookAt 0 2.4 -6.2  0 0.8 0  0 1 0";

const instance = (directive: string, subject: Subject) =>
    `${directive} "${subject.name}" ${subject.parameters}`.trimEnd();

/** The text of the scene that shows a class. */
export function studioScene(subject: Subject, quality: Quality): string {
    const camera = subject.role === "camera" ? instance("Camera", subject) : 'Camera "perspective" "float fov" 28';
    const integrator =
        subject.role === "integrator" ? instance("Integrator", subject) : 'Integrator "path" "integer maxdepth" 8';
    const parts = [
        LOOK_AT,
        camera,
        `Film "rgb" "integer xresolution" ${quality.width} "integer yresolution" ${quality.height}`,
        `Sampler "zsobol" "integer pixelsamples" ${quality.samples}`,
        integrator,
        "WorldBegin",
        ...world(subject),
    ];
    return `${parts.join("\n")}\n`;
}

function world(subject: Subject): string[] {
    switch (subject.role) {
        case "material":
            return [SKY, LAMP, FLOOR, instance("Material", subject), SHAPES];
        case "texture":
            return [
                SKY,
                LAMP,
                FLOOR,
                instance('Texture "subject" "spectrum"', subject),
                'Material "diffuse" "texture reflectance" "subject"',
                SHAPES,
            ];
        case "primitive":
            return [SKY, LAMP, ...(subject.bounds ? [FLOOR] : []), placedPrimitive(subject)];
        case "light":
            // Nothing else shines. Lights with a place, the origin in those of the library, stand above the shapes.
            return [
                `AttributeBegin\n  Translate 0 3.6 -0.5\n  ${instance("LightSource", subject)}\nAttributeEnd`,
                FLOOR,
                STILL_LIFE,
            ];
        case "camera":
        case "integrator":
            return [SKY, LAMP, FLOOR, STILL_LIFE];
    }
}

/** The primitive on the floor, as high or as wide as fits. */
function placedPrimitive(subject: Subject): string {
    const lines = [
        "AttributeBegin",
        '  Material "coateddiffuse" "rgb reflectance" [0.6 0.32 0.12] "float roughness" 0.25',
    ];
    if (subject.bounds) {
        const { low, high } = subject.bounds;
        const extent = Math.max(...high.map((each, axis) => each - low[axis]), 1e-6);
        const middle = (axis: number) => -(low[axis] + high[axis]) / 2;
        const scale = SIZE / extent;
        lines.push(
            "  Rotate 20 0 1 0",
            `  Scale ${scale} ${scale} ${scale}`,
            `  Translate ${middle(0)} ${-low[1]} ${middle(2)}`,
        );
    }
    lines.push(`  ${instance("Shape", subject)}`, "AttributeEnd");
    return lines.join("\n");
}

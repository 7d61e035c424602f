//! Answers about texts, in which `|` is the place of the question.

mod broken;
mod completing;
mod hints;
mod names;
mod shapes;

use rtsl::{MemoryLoader, Span};
use rtsl_ide::Document;

/// A text with a module, and the offset of `|` in it.
struct Question {
    text: String,
    offset: usize,
}

impl Question {
    fn new(text: &str) -> Question {
        let offset = text.find('|').expect("a place is marked");
        Question { text: text.replacen('|', "", 1), offset }
    }

    fn document(&self) -> Document {
        document(&self.text)
    }

    fn offset(&self) -> u32 {
        self.offset as u32
    }
}

fn loader() -> MemoryLoader {
    let mut loader = MemoryLoader::default();
    let module =
        "// Twice as much.\nfloat twice(float x) { return 2.0 * x; }\nconst float HALF = 0.5;\n";
    loader.files.insert("lib/scale.rtsl".to_owned(), module.to_owned());
    loader
}

fn document(text: &str) -> Document {
    Document::new("test.rtsl", text, &mut loader())
}

/// The file, the line and the text of a place.
fn shown(document: &Document, span: Span) -> String {
    let sources = &document.analysis.sources;
    let position = sources.position(span.file, span.start);
    let name = &sources.file(span.file).name;
    format!("{name}:{}:{} `{}`", position.line, position.column, sources.text(span))
}

/// The shader of most tests.
const DISC: &str = "import lib.scale;

// Where a ray meets the plane.
struct Meeting { float distance; vec2 place; };
enum Kind { Round, Square = 4 };

/// A disc.
class Disc : rt_Primitive;

[[min 0, doc \"Radius of the disc.\"]] public float radius = 1.0;
public Kind kind = Round;
private float squared;
scratch vec2 where;
#define LIMIT 1e-3

constructor() { squared = scale.twice(radius) * radius; }

// The meeting with the plane.
Meeting meet(vec3 o, vec3 d) {
    Meeting it;
    it.distance = -o.z / d.z;
    it.place = o.xy + it.distance * d.xy;
    return it;
}

void intersect() {
    Meeting at = meet(rt_RayOrigin, rt_RayDirection);
    int steps = 3;
    float offset = radius * steps;
    float far = dot(at.place, at.place) * LIMIT;
    if (far < squared + offset && hit(at.distance)) where = at.place;
}

void computeNormal() { rt_GeometricNormal = vec3(0.0, 0.0, 1.0); }
";

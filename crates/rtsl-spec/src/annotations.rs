//! The annotations of parameters: their keys and values.

/// A key of an annotation that hosts know: `[[min 0, doc "Radius."]]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AnnotationKey {
    /// The key.
    pub name: &'static str,
    /// The kind of its value.
    pub kind: AnnotationKind,
    /// Its meaning, in one sentence.
    pub doc: &'static str,
}

/// The kinds of values of annotations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AnnotationKind {
    /// Double-quoted text.
    Text,
    /// A constant number.
    Number,
    /// No value.
    Flag,
}

/// The annotation that marks the element parameter of a class; its value names the buffer that it indexes.
pub const ELEMENT: &str = "element";

/// The annotation beside [`ELEMENT`] with the number of the buffer's entries for each element.
pub const STRIDE: &str = "stride";

/// The annotation of parameters that nothing reads on purpose.
pub const UNUSED: &str = "unused";

/// Every key that hosts know.
pub const ANNOTATION_KEYS: [AnnotationKey; 14] = [
    text("label", "The name that interfaces show."),
    text("doc", "A description."),
    text("unit", "The unit of the number."),
    text("group", "The group of parameters to which it belongs."),
    text("widget", "The control for it in interfaces."),
    number("min", "The least value that hosts may set."),
    number("max", "The greatest value that hosts may set."),
    number("softmin", "The least value of a slider."),
    number("softmax", "The greatest value of a slider."),
    number("step", "The distance between values."),
    flag("hidden", "Interfaces do not show it."),
    flag(UNUSED, "It has no effect: it is there so that scenes of other renderers can set it."),
    text(ELEMENT, "Marks the element parameter; names the buffer whose elements it counts."),
    number(STRIDE, "The number of entries of the buffer for each element."),
];

const fn text(name: &'static str, doc: &'static str) -> AnnotationKey {
    AnnotationKey { name, kind: AnnotationKind::Text, doc }
}

const fn flag(name: &'static str, doc: &'static str) -> AnnotationKey {
    AnnotationKey { name, kind: AnnotationKind::Flag, doc }
}

const fn number(name: &'static str, doc: &'static str) -> AnnotationKey {
    AnnotationKey { name, kind: AnnotationKind::Number, doc }
}

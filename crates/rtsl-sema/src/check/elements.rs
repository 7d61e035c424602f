//! The element parameter, which identifies each of the many objects that a host makes of one
//! instance, one for each entry of a buffer.

use rtsl_ir::class::{Annotation, AnnotationValue, ELEMENT, STRIDE};
use rtsl_ir::{Constant, Scalar};
use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};

use super::Checker;
use super::references::quoted_list;
use super::types::is_buffer;
use crate::hir::{Member, Storage, Type};

/// A parameter with annotations.
struct Annotated {
    ty: Type,
    annotations: Vec<Annotation>,
    /// True if hosts can set it.
    public: bool,
    span: Span,
}

impl Checker<'_> {
    /// Checks the annotations `element` and `stride` of the class's parameters.
    pub(super) fn check_elements(&mut self) {
        let parameters = self.annotated_parameters();
        let mut first: Option<Span> = None;
        for parameter in &parameters {
            let value = |key: &str| {
                let annotation = parameter.annotations.iter().find(|it| it.key == key);
                annotation.map(|annotation| &annotation.value)
            };
            let (element, stride) = (value(ELEMENT), value(STRIDE));
            if let Some(AnnotationValue::Text(buffer)) = element {
                self.check_element(parameter, buffer);
                if let Some(first) = first {
                    self.report(
                        Diagnostic::new(
                            codes::BAD_ELEMENT,
                            "a class can have only one element parameter",
                        )
                        .at(parameter.span, "a second one")
                        .label(first, "the first"),
                    );
                }
                first = first.or(Some(parameter.span));
            }
            if let Some(stride) = stride {
                self.check_stride(parameter.span, stride, element.is_some());
            }
        }
    }

    fn annotated_parameters(&self) -> Vec<Annotated> {
        let Some(class) = &self.class else { return Vec::new() };
        let of_constructor = class.constructor.iter().flat_map(|constructor| {
            let function = self.function(constructor.function);
            constructor.parameters.iter().zip(&function.locals).map(|(parameter, local)| {
                let annotations = parameter.annotations.clone();
                Annotated { ty: local.ty.clone(), annotations, public: true, span: function.span }
            })
        });
        let members = class.members.iter().map(|member| {
            let Member { ty, storage, annotations, span, .. } = member;
            let (ty, annotations) = (ty.clone(), annotations.clone());
            Annotated { ty, annotations, public: *storage == Storage::Public, span: *span }
        });
        of_constructor.chain(members).filter(|it| !it.annotations.is_empty()).collect()
    }

    fn check_element(&mut self, parameter: &Annotated, buffer: &str) {
        let is_index = matches!(parameter.ty, Type::Scalar(Scalar::I32 | Scalar::U32));
        if !is_index && parameter.ty != Type::Error {
            self.report(
                Diagnostic::new(codes::BAD_ELEMENT, "an element parameter must be an index")
                    .at(parameter.span, "expected an `int` or a `uint`"),
            );
        }
        if !parameter.public {
            self.report(
                Diagnostic::new(codes::BAD_ELEMENT, "an element parameter must be `public`")
                    .at(parameter.span, "hosts set it"),
            );
        }
        let Some(class) = &self.class else { return };
        let buffers = class.members.iter().filter(|it| is_buffer(&it.ty));
        let buffers: Vec<String> = buffers.map(|member| member.name.clone()).collect();
        if buffers.iter().any(|name| name == buffer) {
            return;
        }
        let diagnostic =
            Diagnostic::new(codes::BAD_ELEMENT, format!("the class has no buffer `{buffer}`"))
                .at(parameter.span, "hosts make an object for each entry of this buffer");
        let names: Vec<&str> = buffers.iter().map(String::as_str).collect();
        self.report(match names.as_slice() {
            [] => diagnostic.note("it has no buffers"),
            names => diagnostic.note(format!("it has {}", quoted_list(names))),
        });
    }

    fn check_stride(&mut self, span: Span, stride: &AnnotationValue, is_element: bool) {
        let is_count = matches!(
            stride,
            AnnotationValue::Constant(Constant::I32(1..) | Constant::U32(1..=0x7fff_ffff))
        );
        let message = match (is_count, is_element) {
            (true, true) => return,
            (false, _) => "`stride` must be a number of entries, at least 1",
            (true, false) => "`stride` is allowed together with `element` only",
        };
        self.report(Diagnostic::new(codes::BAD_ELEMENT, message).at(span, "annotated here"));
    }
}

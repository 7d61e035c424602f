//! Notes of `rtsl check -v` on the rays and lights that methods wait for.

use rtsl::defer::{Kept, Request, examine};
use rtsl::{Class, Method, Place};

use crate::report::Reporter;

/// Reports the rays, lights and calls of `shade` that methods of a class do not wait for, and those that they do, with
/// the reasons. The class is traced, so that its values have places.
pub fn report(class: &Class, reporter: &Reporter) {
    for method in [Method::Shade, Method::Radiance] {
        let Some(function) = class.methods.get(&method) else { continue };
        let name = format!("`{}.{}`", class.name, method.name());
        let found = examine(function);
        let mut counts = Vec::new();
        for request in [Request::Trace, Request::Light, Request::Shade] {
            let count = found.deferred.iter().filter(|it| **it == request).count();
            if count > 0 {
                counts.push(counted(count, request));
            }
        }
        if !counts.is_empty() {
            let message = format!("{name} goes on without waiting for {}", counts.join(" and "));
            reporter.message("note", &message);
        }
        for kept in &found.kept {
            reporter.message("note", &waiting(&name, kept));
        }
    }
}

fn waiting(name: &str, kept: &Kept) -> String {
    let Kept { request, reason, place, cause } = kept;
    let at = place.as_ref().map_or(String::new(), |place| format!("{}: ", line_of(place)));
    let what = match request {
        Request::Trace => "this ray",
        Request::Light => "the shadow rays of this loop",
        Request::Shade => "this call of `shade`",
    };
    let differs =
        |cause: &&Place| place.as_ref().is_none_or(|place| line_of(place) != line_of(cause));
    let cause = cause.as_ref().filter(differs);
    let cause = cause.map_or(String::new(), |cause| format!(" ({})", line_of(cause)));
    format!("{at}{name} waits for {what}: {}{cause}", reason.text())
}

fn line_of(place: &Place) -> String {
    format!("{}:{}", place.source.name, place.line())
}

fn counted(count: usize, request: Request) -> String {
    let (one, many) = match request {
        Request::Trace => ("ray", "rays"),
        Request::Light => ("loop over lights", "loops over lights"),
        Request::Shade => ("call of `shade`", "calls of `shade`"),
    };
    format!("{count} {}", if count == 1 { one } else { many })
}

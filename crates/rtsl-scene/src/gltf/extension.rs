//! Members of extensions, by name. A member that has another type than expected counts as absent.

use gltf::json::Value;

/// The object of an extension.
#[derive(Clone, Copy)]
pub struct Extension<'a>(pub &'a Value);

/// Greater numbers would overflow in shaders.
const LARGEST: f64 = 1e30;

impl<'a> Extension<'a> {
    /// Returns the object `name` in this one.
    pub fn object(self, name: &str) -> Option<Extension<'a>> {
        self.0.get(name).filter(|value| value.is_object()).map(Extension)
    }

    /// Returns the number `name`, or `default`.
    pub fn number(self, name: &str, default: f64) -> f64 {
        self.0.get(name).and_then(number).unwrap_or(default)
    }

    /// Returns the index `name`.
    pub fn index(self, name: &str) -> Option<usize> {
        self.0.get(name)?.as_u64().and_then(|index| usize::try_from(index).ok())
    }

    /// Returns the boolean `name`.
    pub fn boolean(self, name: &str) -> Option<bool> {
        self.0.get(name)?.as_bool()
    }

    /// Returns the text `name`.
    pub fn text(self, name: &str) -> Option<&'a str> {
        self.0.get(name)?.as_str()
    }

    /// Returns the numbers `name`, if there are so many.
    pub fn numbers<const COUNT: usize>(self, name: &str) -> Option<[f64; COUNT]> {
        let numbers: Option<Vec<f64>> = self.0.get(name)?.as_array()?.iter().map(number).collect();
        numbers?.try_into().ok()
    }

    /// Returns the objects in the list `name`.
    pub fn list(self, name: &str) -> impl Iterator<Item = Extension<'a>> {
        self.0.get(name).and_then(Value::as_array).into_iter().flatten().map(Extension)
    }
}

fn number(value: &Value) -> Option<f64> {
    value.as_f64().filter(|number| number.abs() <= LARGEST)
}

/// Returns the extension `name` of an object of the library.
macro_rules! extension {
    ($object:expr, $name:expr) => {
        $object
            .extensions
            .as_ref()
            .and_then(|extensions| extensions.others.get($name))
            .filter(|value| value.is_object())
            .map($crate::gltf::extension::Extension)
    };
}
pub(super) use extension;

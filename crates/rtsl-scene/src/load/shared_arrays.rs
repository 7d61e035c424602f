//! Arrays of shapes, of which equal ones are one: scenes include a mesh several times, and files have copies of meshes.

use std::collections::BTreeMap;

use rtsl::{Numbers, Value};

/// The length from which arrays are compared.
const LEAST: usize = 256;

/// The numbers that are hashed at a time.
const PART: usize = 1 << 14;

/// Arrays by the digests of their types and numbers.
#[derive(Default)]
pub struct SharedArrays(BTreeMap<[u8; 32], Numbers>);

impl SharedArrays {
    /// Replaces arrays by equal ones that were given before.
    pub fn share(&mut self, values: &mut [(String, Value)]) {
        for (_, value) in values {
            let Value::Numbers(numbers) = value else { continue };
            if numbers.words().len() >= LEAST {
                *numbers = self.of(numbers);
            }
        }
    }

    /// The array that is equal to this one and was given first.
    fn of(&mut self, numbers: &Numbers) -> Numbers {
        let mut hasher = blake3::Hasher::new();
        hasher.update(format!("{:?}", numbers.scalar()).as_bytes());
        let mut bytes = Vec::with_capacity(4 * PART);
        for part in numbers.words().chunks(PART) {
            bytes.clear();
            bytes.extend(part.iter().flat_map(|word| word.to_le_bytes()));
            hasher.update(&bytes);
        }
        let digest = *hasher.finalize().as_bytes();
        self.0.entry(digest).or_insert_with(|| numbers.clone()).clone()
    }
}

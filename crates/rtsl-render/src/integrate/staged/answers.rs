//! Answers to searches for the nearest hits.

use rtsl::ResumedBy;

use crate::integrate::host::NO_OBJECT;
use crate::integrate::wavefront::NO_INSTANCE;

/// The number of words of an answer.
pub const WORDS: usize = ResumedBy::NearestHit.answers().len();

/// A hit: object, instance, element, and the bits of the distance.
pub type AnsweredHit = [u32; WORDS - 1];

/// The answer if nothing was hit, after the word that says so.
const NOTHING: AnsweredHit = [NO_OBJECT, NO_INSTANCE, 0, 0];

/// Answers to the searches of successive rays, word by word, as stages read them: whether there is a hit, object,
/// instance, element and distance.
#[derive(Default)]
pub struct Answers {
    words: [Vec<u32>; WORDS],
}

impl Answers {
    /// Answers the searches of so many rays.
    pub fn set(&mut self, count: usize, hit: impl Fn(usize) -> Option<AnsweredHit>) {
        self.words.iter_mut().for_each(|word| word.resize(count, 0));
        let [found, object, instance, element, distance] = &mut self.words;
        let rest = object.iter_mut().zip(instance).zip(element).zip(distance);
        for (ray, (found, (((object, instance), element), distance))) in
            found.iter_mut().zip(rest).enumerate()
        {
            let hit = hit(ray);
            *found = if hit.is_some() { u32::MAX } else { 0 };
            [*object, *instance, *element, *distance] = hit.unwrap_or(NOTHING);
        }
    }

    /// Stores a word of the answers to the lanes of the rays' paths, in ascending order, in a column.
    pub fn store(&self, word: usize, lanes: &[u32], column: &mut [u32]) {
        let words = &self.words[word];
        match (lanes.first(), lanes.last()) {
            // They are adjacent.
            (Some(first), Some(last)) if (last - first) as usize + 1 == lanes.len() => {
                column[*first as usize..=*last as usize].copy_from_slice(words);
            }
            _ => {
                for (lane, word) in lanes.iter().zip(words) {
                    column[*lane as usize] = *word;
                }
            }
        }
    }

    /// Returns a ray's hit.
    pub fn hit(&self, ray: usize) -> Option<AnsweredHit> {
        let [found, hit @ ..] = self.words.each_ref().map(|word| word[ray]);
        (found != 0).then_some(hit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_reach_the_lanes_of_their_rays() {
        let hits = [Some([7, NO_INSTANCE, 3, 2.5_f32.to_bits()]), None, Some([1, 2, 0, 0])];
        let mut answers = Answers::default();
        answers.set(3, |ray| hits[ray]);
        assert_eq!((answers.hit(0), answers.hit(1)), (hits[0], None));
        for lanes in [[2, 3, 4], [0, 3, 5]] {
            for word in 0..WORDS {
                let mut column = [9; 6];
                answers.store(word, &lanes, &mut column);
                for (lane, found) in (0..).zip(column) {
                    let ray = lanes.iter().position(|it| *it == lane);
                    let expected = ray.map_or(9, |ray| match word {
                        0 if hits[ray].is_some() => u32::MAX,
                        0 => 0,
                        _ => hits[ray].unwrap_or(NOTHING)[word - 1],
                    });
                    assert_eq!(found, expected, "{lanes:?} {word} {lane}");
                }
            }
        }
    }
}

//! Pictures that show a part of the image on the film.

use super::Settings;

/// The part of the film's image that is rendered: [`Settings::width`] by [`Settings::height`] pixels of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    /// Columns and rows of the whole image.
    pub whole: [usize; 2],
    /// The column and the row, from the top, of the part's first pixel.
    pub origin: [usize; 2],
}

impl Settings {
    /// Returns columns and rows of the image that the camera sees, of which the picture may be a part.
    pub fn whole_size(&self) -> [usize; 2] {
        self.crop.map_or([self.width, self.height], |crop| crop.whole)
    }

    /// Returns the column and the row, from the top, of the picture's first pixel in the image that the camera sees.
    pub fn origin(&self) -> [usize; 2] {
        self.crop.map_or([0, 0], |crop| crop.origin)
    }

    /// Sets columns and rows of the picture, which keeps showing the same part of the image.
    pub fn set_size(&mut self, width: usize, height: usize) {
        let (old, new) = ([self.width, self.height], [width, height]);
        if let Some(crop) = &mut self.crop {
            for axis in 0..2 {
                let scaled = |length: usize| {
                    let product = length as u128 * new[axis] as u128;
                    usize::try_from((product + old[axis] as u128 / 2) / old[axis].max(1) as u128)
                        .unwrap_or(usize::MAX)
                };
                let (whole, origin) = (scaled(crop.whole[axis]), scaled(crop.origin[axis]));
                crop.whole[axis] = whole.max(new[axis]);
                crop.origin[axis] = origin.min(crop.whole[axis] - new[axis]);
            }
        }
        (self.width, self.height) = (width, height);
    }

    /// Makes the picture one pixel of it: column and row, from the top.
    ///
    /// # Panics
    /// If the picture does not have this pixel.
    pub fn set_pixel(&mut self, pixel: [usize; 2]) {
        assert!(pixel[0] < self.width && pixel[1] < self.height, "pixel {pixel:?}");
        let (whole, origin) = (self.whole_size(), self.origin());
        self.crop = Some(Crop { whole, origin: [origin[0] + pixel[0], origin[1] + pixel[1]] });
        (self.width, self.height) = (1, 1);
    }

    /// Makes the picture the part of the image from `start`, up to and without `end`: column and row.
    pub(super) fn set_part(&mut self, start: [usize; 2], end: [usize; 2]) {
        let whole = [self.width, self.height];
        [self.width, self.height] = [end[0] - start[0], end[1] - start[1]];
        let is_whole = whole == [self.width, self.height];
        self.crop = (!is_whole).then_some(Crop { whole, origin: start });
    }
}

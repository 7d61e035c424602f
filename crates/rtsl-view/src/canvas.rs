//! Text and shapes on an array of pixels.

use std::convert::Infallible;

use embedded_graphics::mono_font::iso_8859_1::FONT_7X13;
use embedded_graphics::mono_font::{MonoFont, MonoTextStyle};
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::*;
use embedded_graphics::primitives::Rectangle;
use embedded_graphics::text::{Baseline, Text};

const FONT: &MonoFont<'_> = &FONT_7X13;

/// The width of a letter, in pixels.
pub const LETTER: i32 = 7;

/// The height of a line of text, in pixels.
pub const LINE: i32 = 15;

/// A colour: `0x00RRGGBB`.
pub type Color = u32;

/// Part of a canvas, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rect {
    /// Its left edge.
    pub x: i32,
    /// Its top edge.
    pub y: i32,
    /// Columns.
    pub width: i32,
    /// Rows.
    pub height: i32,
}

/// Pixels, row by row from the top: `0x00RRGGBB`.
pub struct Canvas<'a> {
    pixels: &'a mut [u32],
    width: i32,
    height: i32,
}

impl<'a> Canvas<'a> {
    /// Draws on `pixels`, in rows of `width`.
    pub fn new(pixels: &'a mut [u32], width: usize) -> Self {
        let height = pixels.len().checked_div(width).unwrap_or(0);
        Canvas { pixels, width: width as i32, height: height as i32 }
    }

    /// Returns columns and rows.
    pub fn size(&self) -> (i32, i32) {
        (self.width, self.height)
    }

    /// Fills a rectangle.
    pub fn fill(&mut self, rect: Rect, color: Color) {
        self.for_each_pixel(rect, |pixel| *pixel = color);
    }

    /// Blends a colour over a rectangle with an opacity of three quarters.
    pub fn cover(&mut self, rect: Rect, color: Color) {
        // Two bits are shifted out of each channel, and masked so that none spills into the next.
        let part = |pixel: u32| (pixel >> 2) & 0x003F_3F3F;
        self.for_each_pixel(rect, |pixel| *pixel = part(*pixel) + 3 * part(color));
    }

    /// Writes a line of text with its top left at (x, y). Letters that the font lacks become `?`.
    pub fn text(&mut self, x: i32, y: i32, text: &str, color: Color) {
        let [_, red, green, blue] = color.to_be_bytes();
        let style = MonoTextStyle::new(FONT, Rgb888::new(red, green, blue));
        let Ok(_) = Text::with_baseline(text, Point::new(x, y), style, Baseline::Top).draw(self);
    }

    fn for_each_pixel(&mut self, rect: Rect, mut change: impl FnMut(&mut u32)) {
        let columns = rect.x.clamp(0, self.width)..(rect.x + rect.width).clamp(0, self.width);
        let rows = rect.y.clamp(0, self.height)..(rect.y + rect.height).clamp(0, self.height);
        for row in rows {
            let start = row * self.width;
            let range = (start + columns.start) as usize..(start + columns.end) as usize;
            if let Some(pixels) = self.pixels.get_mut(range) {
                pixels.iter_mut().for_each(&mut change);
            }
        }
    }
}

impl OriginDimensions for Canvas<'_> {
    fn size(&self) -> Size {
        Size::new(self.width.unsigned_abs(), self.height.unsigned_abs())
    }
}

impl DrawTarget for Canvas<'_> {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(
        &mut self,
        pixels: I,
    ) -> Result<(), Infallible> {
        for Pixel(Point { x, y }, color) in pixels {
            if (0..self.width).contains(&x) && (0..self.height).contains(&y) {
                self.pixels[(y * self.width + x) as usize] = color.into_storage();
            }
        }
        Ok(())
    }

    fn fill_solid(&mut self, area: &Rectangle, color: Rgb888) -> Result<(), Infallible> {
        let (width, height) = (area.size.width as i32, area.size.height as i32);
        let rect = Rect { x: area.top_left.x, y: area.top_left.y, width, height };
        self.fill(rect, color.into_storage());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_outside_is_left_alone() {
        let mut pixels = vec![0; 12];
        let mut canvas = Canvas::new(&mut pixels, 4);
        canvas.fill(Rect { x: 2, y: -5, width: 9, height: 7 }, 7);
        canvas.text(-3, 2, "far too long for it", 9);
        assert_eq!(pixels[..8], [0, 0, 7, 7, 0, 0, 7, 7]);
    }

    #[test]
    fn covers_let_a_quarter_through() {
        let mut pixels = vec![0x00FF_FFFF, 0x0080_0000];
        Canvas::new(&mut pixels, 2).cover(Rect { x: 0, y: 0, width: 2, height: 1 }, 0x0040_4040);
        assert_eq!(pixels, [0x006F_6F6F, 0x0050_3030]);
    }

    #[test]
    fn letters_are_drawn() {
        let mut pixels = vec![0; 14 * 15];
        Canvas::new(&mut pixels, 14).text(0, 0, "I|", 1);
        assert!(pixels.iter().filter(|pixel| **pixel == 1).count() > 10);
    }
}

//! The panel of parameters: the parts of the scene, and for the selected one a slider or a field for each component of
//! its parameters.
//!
//! It is laid out for each paint and each event, as a list of rows, so that painting and hit testing always agree.

use rtsl_render::session::{Control, ControlKind, Thing};
use rtsl_scene::EntityId;

use crate::canvas::{Canvas, Color, LETTER, Rect};

/// The width of the panel.
pub const WIDTH: i32 = 300;

const ROW: i32 = 19;
const MARGIN: i32 = 8;
/// The start and the length of sliders.
const TRACK: i32 = 116;
const TRACK_LENGTH: i32 = 110;

const BACKGROUND: Color = 0x0018_1C20;
const SELECTED: Color = 0x0030_4860;
const TEXT: Color = 0x00E8_E8E8;
const FAINT: Color = 0x00A0_A0A0;
const TRACK_COLOR: Color = 0x0040_464C;
const KNOB: Color = 0x0060_A8E0;

/// The panel and its scroll state.
#[derive(Debug, Default)]
pub struct Panel {
    /// The parts of the scene.
    pub things: Vec<Thing>,
    /// The parameters of the selected part.
    pub controls: Vec<Control>,
    selected: Option<EntityId>,
    /// The number of rows scrolled out at the top.
    scrolled: usize,
    drag: Option<Drag>,
}

/// A slider or a field that is being dragged.
#[derive(Clone, Debug)]
struct Drag {
    control: usize,
    component: usize,
    /// The position of the pointer and the value at the start of the drag.
    from: (f64, f64),
}

/// A request of the panel.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Show the parameters of a part.
    Select(EntityId),
    /// Set a parameter of the selected part.
    Set {
        /// Its name.
        name: String,
        /// All its components.
        values: Vec<f64>,
    },
}

/// A row.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Row {
    /// A part of the scene, by its index.
    Thing(usize),
    /// A component of a parameter: indices of the control and of the component.
    Component(usize, usize),
    /// The explanation of the control that is being dragged.
    Explanation(usize),
}

impl Panel {
    /// Creates a panel of these parts, none of them selected.
    pub fn new(things: Vec<Thing>) -> Self {
        Panel { things, ..Panel::default() }
    }

    /// Returns the selected part.
    pub fn selected(&self) -> Option<EntityId> {
        self.selected
    }

    /// Selects a part with these parameters, and scrolls to it.
    pub fn select(&mut self, entity: Option<EntityId>, controls: Vec<Control>) {
        if self.selected != entity {
            self.drag = None;
        }
        self.selected = entity;
        self.controls = controls;
    }

    /// Scrolls so that the selected part and its parameters are visible in a window of this height, as far as they fit.
    pub fn show_selected(&mut self, height: i32) {
        let index = self.things.iter().position(|thing| Some(thing.entity) == self.selected);
        let Some(index) = index else { return };
        let components = self.controls.iter().map(|control| control.values.len());
        let end = index + 1 + components.sum::<usize>();
        let visible = (height / ROW).max(1) as usize;
        self.scrolled = self.scrolled.max(end.saturating_sub(visible)).min(index);
    }

    /// Scrolls by notches of the wheel.
    pub fn scroll(&mut self, notches: f64) {
        let rows = self.rows().len();
        let target = self.scrolled as f64 - 3.0 * notches;
        self.scrolled = (target.max(0.0) as usize).min(rows.saturating_sub(4));
    }

    /// Handles a press of the pointer at (x, y) of the window, with the panel's left edge at `left`.
    pub fn press(&mut self, left: i32, x: f64, y: f64) -> Option<Request> {
        let row = self.scrolled + (y.max(0.0) / f64::from(ROW)) as usize;
        match *self.rows().get(row)? {
            Row::Thing(index) => Some(Request::Select(self.things[index].entity)),
            Row::Component(control, component) => {
                let held = &self.controls[control];
                let value = held.values[component];
                self.drag = Some(Drag { control, component, from: (x, value) });
                let next = next_choice(held, value);
                match (held.kind, range(held)) {
                    _ if next.is_some() => self.set(next?),
                    (ControlKind::Truth, _) => self.set(1.0 - value),
                    (_, Some(_)) => self.drag_to(left, x),
                    (_, None) => None,
                }
            }
            Row::Explanation(_) => None,
        }
    }

    /// Handles a movement of the pressed pointer.
    pub fn drag_to(&mut self, left: i32, x: f64) -> Option<Request> {
        let Drag { control, from: (start, before), .. } = *self.drag.as_ref()?;
        let control = &self.controls[control];
        if !control.choices.is_empty() {
            return None;
        }
        let value = match (control.kind, range(control)) {
            (ControlKind::Truth, _) => return None,
            (_, Some((least, greatest))) => {
                let track = f64::from(left + TRACK);
                let part = ((x - track) / f64::from(TRACK_LENGTH)).clamp(0.0, 1.0);
                least + (greatest - least) * part
            }
            // A hundredth of the value per pixel; for integers one per ten pixels.
            (kind, None) => {
                let unit =
                    if kind == ControlKind::Whole { 0.1 } else { before.abs().max(0.1) * 0.01 };
                before + (x - start) * unit
            }
        };
        let value = if control.kind == ControlKind::Whole { value.round() } else { value };
        // The range is one of floats; what lies between them may round to outside of it.
        let value = f64::from(value as f32);
        self.set(value.max(control.min.unwrap_or(value)).min(control.max.unwrap_or(value)))
    }

    /// Handles the release of the pointer.
    pub fn release(&mut self) {
        self.drag = None;
    }

    /// True if the pointer drags a control.
    pub fn is_held(&self) -> bool {
        self.drag.is_some()
    }

    /// Returns the height of all rows in pixels.
    pub fn height(&self) -> i32 {
        self.rows().len().saturating_sub(self.scrolled) as i32 * ROW
    }

    /// Paints the panel, whose left edge is at `left`.
    pub fn paint(&self, canvas: &mut Canvas<'_>, left: i32) {
        let height = canvas.size().1.min(self.height());
        canvas.cover(Rect { x: left, y: 0, width: WIDTH, height }, BACKGROUND);
        let visible = (height / ROW + 1).max(0) as usize;
        for (line, row) in (0..).zip(self.rows().into_iter().skip(self.scrolled).take(visible)) {
            let y = line * ROW;
            match row {
                Row::Thing(index) => self.paint_thing(canvas, left, y, &self.things[index]),
                Row::Component(control, component) => {
                    self.paint_component(canvas, left, y, &self.controls[control], component);
                }
                Row::Explanation(control) => {
                    let doc = self.controls[control].doc.as_deref().unwrap_or_default();
                    canvas.text(left + 2 * MARGIN, y + 3, &shortened(doc, 38), FAINT);
                }
            }
        }
    }

    fn set(&mut self, value: f64) -> Option<Request> {
        let Drag { control, component, .. } = *self.drag.as_ref()?;
        let control = &mut self.controls[control];
        if control.values[component] == value {
            return None;
        }
        control.values[component] = value;
        Some(Request::Set { name: control.name.clone(), values: control.values.clone() })
    }

    /// All rows, including those scrolled out.
    fn rows(&self) -> Vec<Row> {
        let mut rows = Vec::with_capacity(self.things.len());
        for (index, thing) in self.things.iter().enumerate() {
            rows.push(Row::Thing(index));
            if Some(thing.entity) != self.selected {
                continue;
            }
            for (index, control) in self.controls.iter().enumerate() {
                rows.extend((0..control.values.len()).map(|it| Row::Component(index, it)));
                let is_held = self.drag.as_ref().is_some_and(|drag| drag.control == index);
                if is_held && control.doc.is_some() {
                    rows.push(Row::Explanation(index));
                }
            }
        }
        rows
    }

    fn paint_thing(&self, canvas: &mut Canvas<'_>, left: i32, y: i32, thing: &Thing) {
        if Some(thing.entity) == self.selected {
            canvas.fill(Rect { x: left, y, width: WIDTH, height: ROW }, SELECTED);
        }
        let class = shortened(&thing.class, 18);
        let title = shortened(&thing.title, 38 - class.chars().count());
        canvas.text(left + MARGIN, y + 3, &title, TEXT);
        let x = left + WIDTH - MARGIN - class.chars().count() as i32 * LETTER;
        canvas.text(x, y + 3, &class, FAINT);
    }

    fn paint_component(
        &self,
        canvas: &mut Canvas<'_>,
        left: i32,
        y: i32,
        control: &Control,
        component: usize,
    ) {
        let color = if component == 0 { TEXT } else { FAINT };
        canvas.text(left + 2 * MARGIN, y + 3, &label(control, component), color);
        let value = control.values[component];
        let track = Rect { x: left + TRACK, y: y + 8, width: TRACK_LENGTH, height: 3 };
        if let Some(name) = name_of_choice(control, value) {
            let field = Rect { x: track.x, y: y + 2, width: TRACK_LENGTH, height: ROW - 4 };
            canvas.fill(field, TRACK_COLOR);
            let letters = (TRACK_LENGTH / LETTER - 3).max(3) as usize;
            canvas.text(field.x + 4, y + 3, &shortened(name, letters), TEXT);
            canvas.text(field.x + TRACK_LENGTH - LETTER - 4, y + 3, ">", FAINT);
            return;
        }
        match (control.kind, range(control)) {
            (ControlKind::Truth, _) => {
                let frame = Rect { x: track.x, y: y + 4, width: 11, height: 11 };
                canvas.fill(frame, TRACK_COLOR);
                if value != 0.0 {
                    canvas.fill(Rect { x: frame.x + 2, y: frame.y + 2, width: 7, height: 7 }, KNOB);
                }
                return;
            }
            (_, Some((least, greatest))) => {
                canvas.fill(track, TRACK_COLOR);
                let part = ((value - least) / (greatest - least)).clamp(0.0, 1.0);
                let x = track.x + (part * f64::from(TRACK_LENGTH)) as i32;
                canvas.fill(Rect { width: x - track.x, ..track }, KNOB);
                canvas.fill(Rect { x: x - 3, y: y + 4, width: 6, height: 11 }, KNOB);
            }
            (_, None) => {
                let field = Rect { x: track.x, y: y + 2, width: TRACK_LENGTH, height: ROW - 4 };
                canvas.fill(field, TRACK_COLOR);
                canvas.text(field.x + 4, y + 3, "<", FAINT);
                canvas.text(field.x + TRACK_LENGTH - LETTER - 4, y + 3, ">", FAINT);
            }
        }
        let text = number(value, control.kind);
        canvas.text(track.x + TRACK_LENGTH + MARGIN, y + 3, &shortened(&text, 9), TEXT);
    }
}

/// The number of the choice after the one with this number, or the first.
fn next_choice(control: &Control, value: f64) -> Option<f64> {
    let index = control.choices.iter().position(|(_, number)| *number == value);
    let next = index.map_or(0, |index| (index + 1) % control.choices.len());
    control.choices.get(next).map(|(_, number)| *number)
}

/// The name of the choice with this number.
fn name_of_choice(control: &Control, value: f64) -> Option<&str> {
    let choice = control.choices.iter().find(|(_, number)| *number == value);
    choice.map(|(name, _)| name.as_str())
}

/// The range of a slider; a colour without an annotated range has one unless it is brighter than white.
fn range(control: &Control) -> Option<(f64, f64)> {
    match (control.min, control.max, control.kind) {
        (Some(least), Some(greatest), _) => (least < greatest).then_some((least, greatest)),
        (_, None, ControlKind::Color) => {
            let dim = control.values.iter().all(|value| (0.0..=1.0).contains(value));
            dim.then_some((0.0, 1.0))
        }
        _ => None,
    }
}

fn label(control: &Control, component: usize) -> String {
    let names: &[&str] = match (control.kind, control.values.len()) {
        (_, 1) => return shortened(&control.label, 13),
        (ControlKind::Color, _) => &["red", "green", "blue"],
        _ => &["x", "y", "z", "w"],
    };
    let name = names.get(component).copied().unwrap_or_default();
    match component {
        0 => format!("{} {name}", shortened(&control.label, 12 - name.len())),
        _ => format!("{name:>13}"),
    }
}

fn number(value: f64, kind: ControlKind) -> String {
    match kind {
        ControlKind::Whole => format!("{value:.0}"),
        ControlKind::Real | ControlKind::Color | ControlKind::Truth => {
            let digits = if value.abs() >= 100.0 { 1 } else { 3 };
            format!("{value:.digits$}")
        }
    }
}

fn shortened(text: &str, letters: usize) -> String {
    if text.chars().count() <= letters {
        return text.to_owned();
    }
    text.chars().take(letters.saturating_sub(2)).chain("..".chars()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rtsl_scene::EntityKind;

    fn control(
        name: &str,
        kind: ControlKind,
        values: &[f64],
        range: Option<(f64, f64)>,
    ) -> Control {
        Control {
            name: name.to_owned(),
            label: name.to_owned(),
            doc: None,
            unit: None,
            kind,
            min: range.map(|range| range.0),
            max: range.map(|range| range.1),
            choices: Vec::new(),
            values: values.to_vec(),
        }
    }

    /// A panel at the window's left edge, with the second of two parts selected.
    fn panel() -> Panel {
        let thing = |index: usize, title: &str| Thing {
            entity: EntityId(index),
            kind: EntityKind::Material,
            title: title.to_owned(),
            class: "Ward".to_owned(),
        };
        let mut panel = Panel::new(vec![thing(3, "steel"), thing(5, "floor")]);
        let controls = vec![
            control("roughness", ControlKind::Real, &[0.5], Some((0.0, 2.0))),
            control("on", ControlKind::Truth, &[0.0], None),
            control("tint", ControlKind::Color, &[0.2, 0.4, 0.6], None),
            control("offset", ControlKind::Real, &[10.0], None),
            control("count", ControlKind::Whole, &[3.0], None),
        ];
        panel.select(Some(EntityId(5)), controls);
        panel
    }

    /// The middle of a row.
    fn y(row: i32) -> f64 {
        f64::from(row * ROW + ROW / 2)
    }

    fn x(part: f64) -> f64 {
        f64::from(TRACK) + part * f64::from(TRACK_LENGTH)
    }

    fn set(name: &str, values: &[f64]) -> Option<Request> {
        Some(Request::Set { name: name.to_owned(), values: values.to_vec() })
    }

    #[test]
    fn a_click_on_a_part_selects_it() {
        assert_eq!(panel().press(0, 20.0, y(0)), Some(Request::Select(EntityId(3))));
        assert_eq!(panel().press(0, 20.0, y(40)), None);
    }

    #[test]
    fn sliders_go_where_the_pointer_is() {
        let mut panel = panel();
        assert_eq!(panel.press(0, x(0.5), y(2)), set("roughness", &[1.0]));
        assert_eq!(panel.drag_to(0, x(0.25)), set("roughness", &[0.5]));
        assert_eq!(panel.drag_to(0, x(7.0)), set("roughness", &[2.0]), "the range is kept");
        assert_eq!(panel.drag_to(0, x(8.0)), None, "nothing changed");
        panel.release();
        assert_eq!(panel.drag_to(0, x(0.1)), None);
    }

    #[test]
    fn components_of_a_colour_have_sliders_of_their_own() {
        assert_eq!(panel().press(0, x(1.0), y(5)), set("tint", &[0.2, 1.0, 0.6]));
    }

    #[test]
    fn a_box_is_ticked_by_a_click() {
        let mut panel = panel();
        assert_eq!(panel.press(0, x(0.0), y(3)), set("on", &[1.0]));
        assert_eq!(panel.drag_to(0, x(1.0)), None);
    }

    #[test]
    fn a_click_takes_the_next_choice() {
        let mut panel = panel();
        panel.controls[4].choices =
            [("None", 3.0), ("Some", 5.0)].map(|(name, number)| (name.to_owned(), number)).into();
        for expected in [5.0, 3.0, 5.0] {
            assert_eq!(panel.press(0, x(0.5), y(8)), set("count", &[expected]));
            assert_eq!(panel.drag_to(0, x(1.0)), None);
            panel.release();
        }
        assert_eq!(name_of_choice(&panel.controls[4], 5.0), Some("Some"));
        assert_eq!(name_of_choice(&panel.controls[4], 4.0), None);
        assert_eq!(next_choice(&panel.controls[4], 4.0), Some(3.0));
        assert_eq!(next_choice(&panel.controls[3], 4.0), None);
    }

    #[test]
    fn fields_without_a_range_are_dragged() {
        let mut panel = panel();
        assert_eq!(panel.press(0, x(0.0), y(7)), None);
        assert_eq!(panel.drag_to(0, x(0.0) + 5.0), set("offset", &[10.5]));
        panel.release();
        assert_eq!(panel.press(0, x(0.0), y(8)), None);
        assert_eq!(panel.drag_to(0, x(0.0) - 24.0), set("count", &[1.0]));
    }

    #[test]
    fn a_painted_slider_follows_its_value() {
        let painted = |value: f64| {
            let mut panel = panel();
            panel.controls[0].values = vec![value];
            let mut pixels = vec![0; WIDTH as usize * 200];
            panel.paint(&mut Canvas::new(&mut pixels, WIDTH as usize), 0);
            let row = &pixels[WIDTH as usize * (2 * ROW as usize + 9)..][..WIDTH as usize];
            row.iter().filter(|pixel| **pixel == KNOB).count()
        };
        assert!(painted(0.2) < painted(1.0) && painted(1.0) < painted(1.8));
    }

    #[test]
    fn what_is_selected_is_shown() {
        let mut panel = panel();
        panel.show_selected(20 * ROW);
        assert_eq!(panel.scrolled, 0, "all of it shows");
        panel.show_selected(8 * ROW);
        assert_eq!(panel.scrolled, 1, "two parts and seven components");
        panel.show_selected(2 * ROW);
        assert_eq!(panel.scrolled, 1, "the part itself before its parameters");
    }

    #[test]
    fn scrolling_hides_rows_at_the_top() {
        let mut panel = panel();
        panel.scroll(-1.0);
        assert_eq!(panel.press(0, x(1.0), y(0)), set("on", &[1.0]));
        panel.scroll(9.0);
        assert_eq!(panel.press(0, 20.0, y(1)), Some(Request::Select(EntityId(5))));
    }
}

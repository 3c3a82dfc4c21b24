//! What is found as tables: one header, the unit in the name of each column.

use crate::events::{Event, Stay};
use crate::{Measured, State, Unit};
use nalgebra::{Matrix2, Vector2};

/// The cells of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum Cells {
    /// Whole numbers.
    Whole(Vec<u64>),
    /// Numbers with so many decimals; an empty cell is not a number.
    Number(Vec<f64>, usize),
    /// Words without commas, quotes or line breaks.
    Word(Vec<String>),
    /// Words of which there are few.
    Kind(Vec<&'static str>),
}

/// A column.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name with its unit.
    pub name: String,
    /// What it holds.
    pub cells: Cells,
}

/// Columns of equal length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// In their order.
    pub columns: Vec<Column>,
}

impl Table {
    /// How many rows it has.
    pub fn len(&self) -> usize {
        self.columns.first().map_or(0, |c| match &c.cells {
            Cells::Whole(v) => v.len(),
            Cells::Number(v, _) => v.len(),
            Cells::Word(v) => v.len(),
            Cells::Kind(v) => v.len(),
        })
    }

    /// Whether it has no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The numbers of a column.
    pub fn numbers(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|c| c.name == name).and_then(|c| match &c.cells {
            Cells::Number(values, _) => Some(values.as_slice()),
            _ => None,
        })
    }

    fn push(&mut self, name: impl Into<String>, cells: Cells) {
        self.columns.push(Column { name: name.into(), cells });
    }

    /// A number and its standard deviation, to as many decimals as the least deviation has a meaning for.
    fn push_pair(&mut self, name: &str, unit: &str, pairs: impl Iterator<Item = Option<(f64, f64)>>) {
        let (values, errors): (Vec<f64>, Vec<f64>) = pairs.map(|p| p.unwrap_or((f64::NAN, f64::NAN))).unzip();
        let least = errors.iter().copied().filter(|e| *e > 0.0).fold(f64::INFINITY, f64::min);
        let decimals = if least.is_finite() { (2.0 - least.log10().floor()).clamp(0.0, 12.0) as usize } else { 6 };
        self.push(format!("{name}_{unit}"), Cells::Number(values, decimals));
        self.push(format!("{name}_sd_{unit}"), Cells::Number(errors, decimals));
    }
}

/// Position, velocity, acceleration and the rest, a row for each frame of each target.
pub fn kinematics_table(targets: &[Measured], unit: Unit) -> Table {
    let moments = || targets.iter().flat_map(|m| m.moments.iter().map(move |moment| (m.target, moment)));
    let (length, mut table) = (unit.symbol(), Table::default());
    let (speed, acceleration) = (format!("{length}_per_s"), format!("{length}_per_s2"));
    table.push("frame", Cells::Whole(moments().map(|(_, m)| m.frame).collect()));
    table.push("time_s", Cells::Number(moments().map(|(_, m)| m.time_s).collect(), 6));
    table.push("target", Cells::Whole(moments().map(|(target, _)| target).collect()));
    table.push("how", Cells::Kind(moments().map(|(_, m)| m.how.as_str()).collect()));
    let of = |get: &dyn Fn(&State) -> Option<(f64, f64)>| -> Vec<Option<(f64, f64)>> {
        moments().map(|(_, m)| m.state.as_ref().and_then(get)).collect()
    };
    let component = |i: usize| of(&move |s| Some((s.mean()[i], s.deviation(i))));
    table.push_pair("x", length, component(0).into_iter());
    table.push_pair("y", length, component(1).into_iter());
    table.push_pair("vx", &speed, component(2).into_iter());
    table.push_pair("vy", &speed, component(3).into_iter());
    table.push_pair("speed", &speed, of(&|s| Some(s.speed())).into_iter());
    table.push_pair("ax", &acceleration, component(4).into_iter());
    table.push_pair("ay", &acceleration, component(5).into_iter());
    table.push_pair("acceleration", &acceleration, of(&|s| Some(s.acceleration_magnitude())).into_iter());
    table.push_pair("heading", "deg", of(&State::heading_deg).into_iter());
    table.push_pair("path", length, moments().map(|(_, m)| m.path));
    let measured =
        |axis: usize| -> Vec<f64> { moments().map(|(_, m)| m.measured.map_or(f64::NAN, |p| p[axis])).collect() };
    let decimals = table.columns.iter().find(|c| c.name == format!("x_{length}")).map_or(6, |c| match &c.cells {
        Cells::Number(_, decimals) => *decimals,
        _ => 6,
    });
    table.push(format!("measured_x_{length}"), Cells::Number(measured(0), decimals));
    table.push(format!("measured_y_{length}"), Cells::Number(measured(1), decimals));
    table
}

/// What happened, a row for each event.
pub fn events_table(events: &[Event], unit: Unit) -> Table {
    let (length, mut table) = (unit.symbol(), Table::default());
    table.push("target", Cells::Whole(events.iter().map(|e| e.target).collect()));
    table.push("event", Cells::Kind(events.iter().map(|e| e.kind.as_str()).collect()));
    table.push("frame", Cells::Whole(events.iter().map(|e| e.frame).collect()));
    table.push("time_s", Cells::Number(events.iter().map(|e| e.time_s).collect(), 6));
    table.push("time_sd_s", Cells::Number(events.iter().map(|e| e.time_error_s).collect(), 6));
    for (axis, name) in ["x", "y"].into_iter().enumerate() {
        table.push(format!("{name}_{length}"), Cells::Number(events.iter().map(|e| e.at[axis]).collect(), 6));
    }
    table.push("name", Cells::Word(events.iter().map(|e| word(e.name.as_deref().unwrap_or_default())).collect()));
    table
}

/// The time of each target in each zone, a row for both.
pub fn stays_table(stays: &[Stay], unit: Unit) -> Table {
    let (length, mut table) = (unit.symbol(), Table::default());
    let number = |of: fn(&Stay) -> f64| Cells::Number(stays.iter().map(of).collect(), 6);
    table.push("target", Cells::Whole(stays.iter().map(|s| s.target).collect()));
    table.push("zone", Cells::Word(stays.iter().map(|s| word(&s.zone)).collect()));
    table.push("inside_s", number(|s| s.inside_s));
    table.push("inside_sd_s", number(|s| s.inside_error_s));
    table.push("share", number(|s| s.share));
    table.push("visits", Cells::Whole(stays.iter().map(|s| s.visits as u64).collect()));
    table.push("first_s", number(|s| s.first_s.unwrap_or(f64::NAN)));
    table.push(format!("path_{length}"), number(|s| s.path));
    table.push(format!("speed_{length}_per_s"), number(|s| s.speed.unwrap_or(f64::NAN)));
    table
}

/// A name without what would break a row.
fn word(name: &str) -> String {
    name.replace([',', '"', '\n', '\r'], " ")
}

/// Distance and direction from one target to another, in the frames in which both are known. What is common to both, the errors
/// of the ruler, is taken for independent: the distance is a little better than it says.
pub fn between(a: &Measured, b: &Measured, unit: Unit) -> Table {
    let mut rows = Vec::new();
    let mut others = b.moments.iter().peekable();
    for moment in &a.moments {
        while others.next_if(|o| o.frame < moment.frame).is_some() {}
        let Some(other) = others.peek().filter(|o| o.frame == moment.frame) else { continue };
        let (Some(from), Some(to)) = (&moment.state, &other.state) else { continue };
        let apart = Vector2::from(to.position()) - Vector2::from(from.position());
        let covariance: Matrix2<f64> =
            from.covariance().fixed_view::<2, 2>(0, 0) + to.covariance().fixed_view::<2, 2>(0, 0);
        let distance = apart.norm();
        let along = if distance > 0.0 { apart / distance } else { Vector2::x() };
        let across = Vector2::new(-along.y, along.x);
        let error = |d: Vector2<f64>| (d.transpose() * covariance * d)[0].max(0.0).sqrt();
        let angle = (distance > 2.0 * error(across))
            .then(|| (apart.y.atan2(apart.x).to_degrees(), (error(across) / distance).to_degrees()));
        rows.push((moment.frame, moment.time_s, (distance, error(along)), angle));
    }
    let mut table = Table::default();
    table.push("frame", Cells::Whole(rows.iter().map(|r| r.0).collect()));
    table.push("time_s", Cells::Number(rows.iter().map(|r| r.1).collect(), 6));
    table.push("from", Cells::Whole(vec![a.target; rows.len()]));
    table.push("to", Cells::Whole(vec![b.target; rows.len()]));
    table.push_pair("distance", unit.symbol(), rows.iter().map(|r| Some(r.2)));
    table.push_pair("direction", "deg", rows.iter().map(|r| r.3));
    table
}

use super::xml::Element;

/// The least and the greatest value of a component.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// The least.
    pub min: f64,
    /// The greatest.
    pub max: f64,
}

impl Range {
    fn read(element: &Element, name: &str) -> Option<Self> {
        let range = element.find(name)?;
        let number = |name| range.text_of(name)?.parse().ok().filter(|value: &f64| value.is_finite());
        let (min, max) = (number("Min")?, number("Max")?);
        (min < max).then_some(Self { min, max })
    }

    /// The value nearest to `value`.
    pub const fn clamp(&self, value: f64) -> f64 {
        value.clamp(self.min, self.max)
    }

    /// The value that lies in this range as `value` lies in `[from.0, from.1]`.
    pub fn scaled(&self, value: f64, from: (f64, f64)) -> f64 {
        let part = ((value - from.0) / (from.1 - from.0)).clamp(0.0, 1.0);
        self.min + part * (self.max - self.min)
    }

    /// Where in `[to.0, to.1]` a value of this range lies.
    pub fn unscaled(&self, value: f64, to: (f64, f64)) -> f64 {
        let part = ((value - self.min) / (self.max - self.min)).clamp(0.0, 1.0);
        to.0 + part * (to.1 - to.0)
    }
}

/// A coordinate space that a camera offers.
#[derive(Debug, Clone, PartialEq)]
pub struct Space {
    /// Its name, the last part of its URI.
    pub name: String,
    /// Its URI.
    pub uri: String,
    /// The first component's range.
    pub x: Range,
    /// The second component's range, where there is one.
    pub y: Option<Range>,
}

/// The coordinate spaces that a camera offers, best first.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Spaces {
    /// For going to pans and tilts.
    pub position: Option<Space>,
    /// For going to zooms.
    pub zoom_position: Option<Space>,
    /// For turning by pans and tilts.
    pub translation: Option<Space>,
    /// For moving at velocities.
    pub velocity: Option<Space>,
    /// For zooming at velocities.
    pub zoom_velocity: Option<Space>,
}

impl Spaces {
    /// The spaces in an answer to `GetNodes`, `GetNode` or `GetConfigurationOptions`.
    pub fn read(answer: &Element) -> Self {
        let best = |kind: &str, wishes: &[&str]| {
            let mut found = Vec::new();
            answer.find_all(kind, &mut found);
            let spaces: Vec<Space> = found.into_iter().filter_map(space).collect();
            let wished = wishes.iter().find_map(|wish| spaces.iter().find(|space| space.name == *wish));
            wished.cloned()
        };
        Self {
            position: best("AbsolutePanTiltPositionSpace", &["SphericalPositionSpaceDegrees", "PositionGenericSpace"]),
            zoom_position: best("AbsoluteZoomPositionSpace", &["PositionGenericSpace"]),
            translation: best(
                "RelativePanTiltTranslationSpace",
                &["SphericalTranslationSpaceDegrees", "TranslationSpaceFov", "TranslationGenericSpace"],
            ),
            velocity: best("ContinuousPanTiltVelocitySpace", &["VelocitySpaceDegrees", "VelocityGenericSpace"]),
            zoom_velocity: best("ContinuousZoomVelocitySpace", &["VelocityGenericSpace"]),
        }
    }
}

fn space(element: &Element) -> Option<Space> {
    let uri = element.text_of("URI")?.to_owned();
    let name = uri.rsplit('/').next()?.to_owned();
    Some(Space { name, uri, x: Range::read(element, "XRange")?, y: Range::read(element, "YRange") })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drivers::onvif::parse_answer;

    #[test]
    fn spaces_are_read_and_the_best_is_taken() {
        let space = |kind: &str, name: &str, min: &str| {
            format!(
                "<{kind}><URI>http://www.onvif.org/ver10/tptz/{name}</URI><XRange><Min>{min}</Min><Max>1</Max></XRange>\
                 <YRange><Min>-2</Min><Max>2</Max></YRange></{kind}>"
            )
        };
        let text = format!(
            "<N>{}{}{}{}</N>",
            space("RelativePanTiltTranslationSpace", "PanTiltSpaces/TranslationGenericSpace", "-1"),
            space("RelativePanTiltTranslationSpace", "PanTiltSpaces/TranslationSpaceFov", "-1"),
            space("ContinuousPanTiltVelocitySpace", "PanTiltSpaces/SomethingElse", "-1"),
            space("AbsoluteZoomPositionSpace", "ZoomSpaces/PositionGenericSpace", "oops"),
        );
        let spaces = Spaces::read(&parse_answer(&text).unwrap());
        let translation = spaces.translation.unwrap();
        assert_eq!(translation.name, "TranslationSpaceFov");
        assert_eq!(translation.y, Some(Range { min: -2.0, max: 2.0 }));
        assert_eq!((spaces.velocity, spaces.zoom_position, spaces.position), (None, None, None));
    }

    #[test]
    fn values_are_carried_between_ranges() {
        let range = Range { min: -1.0, max: 1.0 };
        assert_eq!(range.scaled(90.0, (-180.0, 180.0)), 0.5);
        assert_eq!(range.unscaled(0.5, (-180.0, 180.0)), 90.0);
        assert_eq!((range.scaled(999.0, (-180.0, 180.0)), range.clamp(-7.0)), (1.0, -1.0));
        assert_eq!(range.unscaled(-7.0, (0.0, 1.0)), 0.0);
    }
}

use crate::runtime::RuntimeParams;
use pursuit_parameters::{Bounds, Field, FileName, Kind, Value};
use serde::{Deserialize, Serialize};

/// Names of classes: a list, or a text in which commas part them.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ClassNames(pub Vec<String>);

impl From<&str> for ClassNames {
    fn from(text: &str) -> Self {
        Self(text.split(',').map(str::trim).filter(|name| !name.is_empty()).map(str::to_owned).collect())
    }
}

impl Field for ClassNames {
    fn kind(&self, _: Bounds) -> Kind {
        Kind::Text
    }

    fn value(&self) -> Option<Value> {
        Some(self.0.join(",").into())
    }

    fn check(&self, _: &Bounds) -> Result<(), (String, String)> {
        Ok(())
    }

    fn set(&mut self, _: &str, value: &Value) -> Result<(), String> {
        let wrong = || format!("invalid type: {}, expected names, for example \"person,car\"", value.type_str());
        *self = match value {
            Value::String(text) => text.as_str().into(),
            Value::Array(names) => {
                let names: Option<Vec<&str>> = names.iter().map(Value::as_str).collect();
                names.ok_or_else(wrong)?.join(",").as_str().into()
            }
            _ => return Err(wrong()),
        };
        Ok(())
    }
}

pursuit_parameters::parameters! {
    /// Parameters of the detector of objects.
    pub struct ObjectsParams {
        /// The network: an ONNX file. What it is its answer and the names in it tell, or a TOML file of its name beside it.
        pub model: FileName = FileName::default();
        /// Classes to find, parted by commas; empty: all that the network knows.
        pub classes: ClassNames = ClassNames::default(), source "of YOLOX: the 80 names of COCO, person, bicycle, car …";
        /// Boxes with a lower score are passed over.
        pub score: f64 = 0.25, in 0.0..=1.0, source "YOLOX, demo.py: 0.3";
        /// Of boxes of one class that overlap by more (IoU), the best is kept.
        pub overlap: f64 = 0.45, in 0.0..=1.0, source "YOLOX, demo_utils.py";
        /// Most boxes that are compared with each other, the best.
        pub candidates: usize = 1000, in 1..=100_000, source "ours";
        /// Most objects in a frame, the best.
        pub most: usize = 100, in 1..=10_000, source "ours";
        /// How the network is run.
        pub runtime: RuntimeParams = RuntimeParams::default();
    }
}

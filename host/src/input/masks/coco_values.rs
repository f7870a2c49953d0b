//! Values of COCO JSON that may be of several types. Each is told by its first sign: to try one
//! type after the other, all of it would first be held as values of any type, 16 times as long as
//! text.

use crate::formats::bounds::{MAX_POLYGONS, thousands};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// Image of an object: its number, or the name of its file.
#[derive(Debug, PartialEq)]
pub enum ImageId {
    Number(u64),
    Name(String),
}

/// Outline of an object.
#[derive(Debug, PartialEq)]
pub enum Segmentation {
    Polygons(Vec<Vec<f64>>),
    Runs { size: [usize; 2], counts: Counts },
}

/// Run lengths, in characters or in numbers.
#[derive(Debug, PartialEq)]
pub enum Counts {
    Text(String),
    Numbers(Vec<i64>),
}

impl<'de> Deserialize<'de> for ImageId {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl Visitor<'_> for Either {
            type Value = ImageId;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("the number or name of an image")
            }

            fn visit_u64<E: Error>(self, number: u64) -> Result<ImageId, E> {
                Ok(ImageId::Number(number))
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<ImageId, E> {
                Ok(ImageId::Name(name.to_owned()))
            }
        }
        deserializer.deserialize_any(Either)
    }
}

impl<'de> Deserialize<'de> for Segmentation {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(serde::Deserialize)]
        struct Runs {
            size: [usize; 2],
            counts: Counts,
        }
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Segmentation;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("polygons or run lengths")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Segmentation, A::Error> {
                let mut polygons = Vec::new();
                while let Some(polygon) = list.next_element()? {
                    polygons.push(polygon);
                    if polygons.len() > MAX_POLYGONS {
                        let most = thousands(MAX_POLYGONS);
                        return Err(A::Error::custom(format!(
                            "an object has more polygons than the {most} that are read"
                        )));
                    }
                }
                Ok(Segmentation::Polygons(polygons))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Segmentation, A::Error> {
                let Runs { size, counts } = Runs::deserialize(MapAccessDeserializer::new(map))?;
                Ok(Segmentation::Runs { size, counts })
            }
        }
        deserializer.deserialize_any(Either)
    }
}

impl<'de> Deserialize<'de> for Counts {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Counts;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("run lengths as text or numbers")
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<Counts, E> {
                Ok(Counts::Text(text.to_owned()))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Counts, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(list)).map(Counts::Numbers)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_type_is_told_by_its_first_sign_and_polygons_have_a_bound() {
        let polygons: Segmentation = serde_json::from_str("[[1, 2.5], []]").unwrap();
        assert_eq!(polygons, Segmentation::Polygons(vec![vec![1.0, 2.5], vec![]]));
        let runs = r#"{"counts": "04", "size": [2, 3], "more": 1}"#;
        let runs: Segmentation = serde_json::from_str(runs).unwrap();
        let counts = Counts::Text("04".to_owned());
        assert_eq!(runs, Segmentation::Runs { size: [2, 3], counts });
        let numbers: Counts = serde_json::from_str("[3, -1]").unwrap();
        assert_eq!(numbers, Counts::Numbers(vec![3, -1]));
        let ids: Vec<ImageId> = serde_json::from_str("[7, \"a.png\"]").unwrap();
        assert_eq!(ids, [ImageId::Number(7), ImageId::Name("a.png".to_owned())]);
        let many = format!("[{}[]]", "[],".repeat(MAX_POLYGONS));
        let error = serde_json::from_str::<Segmentation>(&many).unwrap_err().to_string();
        assert!(error.contains("more polygons than the 10,000"), "{error}");
        assert!(serde_json::from_str::<Segmentation>("1").is_err());
    }
}

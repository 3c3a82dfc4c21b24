use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

/// An element of an answer: names without their prefixes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Element {
    /// Its name.
    pub name: String,
    /// Its attributes.
    pub attributes: Vec<(String, String)>,
    /// The text directly in it.
    pub text: String,
    /// The elements directly in it.
    pub children: Vec<Self>,
}

/// How deep and how many elements an answer may have.
const DEEPEST: usize = 64;
const MOST_ELEMENTS: usize = 20_000;

/// Reads an answer.
///
/// # Errors
/// What is wrong with it, for people to read: no XML, a document type (which may hide a bomb), too deep, too many elements.
pub fn parse_answer(text: &str) -> Result<Element, String> {
    let mut reader = Reader::from_str(text);
    let mut open: Vec<Element> = vec![Element::default()];
    let mut count = 0;
    loop {
        match reader.read_event().map_err(|error| error.to_string())? {
            Event::Start(start) => {
                count += 1;
                if open.len() > DEEPEST || count > MOST_ELEMENTS {
                    return Err(format!("more than {DEEPEST} levels or {MOST_ELEMENTS} elements"));
                }
                open.push(element(&start)?);
            }
            Event::Empty(start) => {
                count += 1;
                let empty = element(&start)?;
                open.last_mut().ok_or("an end too many")?.children.push(empty);
            }
            Event::End(_) => {
                let closed = open.pop().ok_or("an end too many")?;
                open.last_mut().ok_or("an end too many")?.children.push(closed);
            }
            Event::Text(text) => append(&mut open, &text.xml10_content()),
            Event::CData(text) => append(&mut open, &text.xml10_content()),
            Event::GeneralRef(reference) => {
                let number = reference.resolve_char_ref().map_err(|error| error.to_string())?;
                let named =
                    || quick_xml::escape::resolve_predefined_entity(&reference.xml10_content()).map(str::to_owned);
                let text = number.map(String::from).or_else(named).ok_or("an unknown entity")?;
                append(&mut open, &text);
            }
            Event::DocType(_) => return Err("it has a document type, which SOAP forbids".to_owned()),
            Event::Eof => break,
            Event::Comment(_) | Event::Decl(_) | Event::PI(_) => {}
        }
    }
    match (open.pop(), open.is_empty()) {
        (Some(root), true) => root.children.into_iter().next().ok_or_else(|| "it has no element".to_owned()),
        _ => Err("it ends before its elements do".to_owned()),
    }
}

fn append(open: &mut [Element], text: &str) {
    if let Some(element) = open.last_mut() {
        element.text.push_str(text);
    }
}

fn element(start: &BytesStart<'_>) -> Result<Element, String> {
    let mut attributes = Vec::new();
    for attribute in start.attributes().with_checks(false) {
        let attribute = attribute.map_err(|error| error.to_string())?;
        let value = attribute.normalized_value(XmlVersion::Implicit1_0).map_err(|error| error.to_string())?;
        attributes.push((local(attribute.key.as_ref()), value.into_owned()));
    }
    Ok(Element { name: local(start.name().as_ref()), attributes, ..Element::default() })
}

/// A name without its prefix.
fn local(name: &str) -> String {
    name.rsplit_once(':').map_or(name, |(_, local)| local).to_owned()
}

impl Element {
    /// The first element of this name in it, at any depth, itself included.
    pub fn find(&self, name: &str) -> Option<&Self> {
        if self.name == name {
            return Some(self);
        }
        self.children.iter().find_map(|child| child.find(name))
    }

    /// All elements of this name in it, at any depth; those within another one are not looked for.
    pub fn find_all<'a>(&'a self, name: &str, found: &mut Vec<&'a Self>) {
        for child in &self.children {
            if child.name == name {
                found.push(child);
            } else {
                child.find_all(name, found);
            }
        }
    }

    /// The text of the first element of this name, trimmed, if it has any.
    pub fn text_of(&self, name: &str) -> Option<&str> {
        self.find(name).map(|element| element.text.trim()).filter(|text| !text.is_empty())
    }

    /// The value of an attribute.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    /// A finite number in an attribute.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.attribute(name)?.trim().parse().ok().filter(|value: &f64| value.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_are_read_without_their_prefixes() {
        let root = parse_answer(
            r#"<?xml version="1.0"?><s:Envelope xmlns:s="x"><!-- c --><s:Body><tt:A t:token="p&amp;q"><tt:B> 1 &lt; &#50;</tt:B>
               <tt:C/></tt:A><A><B><![CDATA[<raw>]]></B></A></s:Body></s:Envelope>"#,
        )
        .unwrap();
        assert_eq!(root.name, "Envelope");
        assert_eq!(root.text_of("B"), Some("1 < 2"));
        assert_eq!(root.find("A").unwrap().attribute("token"), Some("p&q"));
        assert_eq!((root.text_of("C"), root.find("D")), (None, None));
        let mut all = Vec::new();
        root.find_all("A", &mut all);
        assert_eq!(all.len(), 2);
        assert_eq!(all[1].text_of("B"), Some("<raw>"));
    }

    #[test]
    fn numbers_are_finite() {
        let root = parse_answer(r#"<P x="-0.5" y="nan" z="inf" w="1e3x"/>"#).unwrap();
        assert_eq!(["x", "y", "z", "w", "v"].map(|name| root.number(name)), [Some(-0.5), None, None, None, None]);
    }

    #[test]
    fn what_is_no_sound_answer_is_refused() {
        let deep = "<a>".repeat(100) + &"</a>".repeat(100);
        let wide = format!("<a>{}</a>", "<b></b>".repeat(30_000));
        for bad in [
            "",
            "not xml at all",
            "<a><b></a>",
            "<a>",
            "</a>",
            "<a b=></a>",
            "<a>&unknown;</a>",
            "<!DOCTYPE a [<!ENTITY b 'c'>]><a>&b;</a>",
            deep.as_str(),
            wide.as_str(),
        ] {
            assert!(parse_answer(bad).is_err(), "{}", &bad[..bad.len().min(40)]);
        }
    }
}

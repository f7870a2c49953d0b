//! XML within bounds.

use super::bounds::{MAX_XML_ATTRIBUTES, MAX_XML_NODES, thousands};
use roxmltree::{Document, Error, ParsingOptions};

/// Parses XML without a document type, which could name other files or entities.
///
/// # Errors
/// Names the fault, as the rest of a sentence.
pub fn xml(text: &str) -> Result<Document<'_>, String> {
    let attributes = most_attributes(text);
    if attributes > MAX_XML_ATTRIBUTES {
        return Err(format!(
            "an element of its XML has {attributes} attributes; at most {MAX_XML_ATTRIBUTES} are \
             read"
        ));
    }
    let options = ParsingOptions { nodes_limit: MAX_XML_NODES, ..ParsingOptions::default() };
    Document::parse_with_options(text, options).map_err(|error| match error {
        Error::NodesLimitReached => {
            format!("its XML has more elements than the {} that are read", thousands(MAX_XML_NODES))
        }
        error => format!("it is not XML: {error}"),
    })
}

/// The most attributes of any element, told without parsing: each has a sign of equality outside
/// its quotes.
fn most_attributes(text: &str) -> usize {
    let (mut most, mut here) = (0, 0);
    let (mut in_tag, mut quote) = (false, None);
    for byte in text.bytes() {
        match (byte, in_tag, quote) {
            (_, true, Some(end)) if byte == end => quote = None,
            (_, true, Some(_)) => {}
            (b'"' | b'\'', true, None) => quote = Some(byte),
            (b'=', true, None) => here += 1,
            (b'>', true, None) => in_tag = false,
            (b'<', false, _) => (in_tag, here) = (true, 0),
            _ => {}
        }
        most = most.max(here);
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_elements_and_document_types_have_a_bound() {
        let of = |count: usize| {
            let attributes: String = (0..count).map(|at| format!(" a{at}='=>'")).collect();
            format!("<r><e{attributes}/><e/></r>")
        };
        assert!(xml(&of(MAX_XML_ATTRIBUTES)).is_ok());
        let refused = xml(&of(60_000)).unwrap_err();
        assert!(refused.contains("has 60000 attributes; at most 64"), "{refused}");
        let many = format!("<r>{}</r>", "<e/>".repeat(10_001));
        assert!(xml(&many).unwrap_err().contains("the 10,000 that are read"));
        let typed = "<!DOCTYPE r [<!ENTITY a 'b'>]><r>&a;</r>";
        assert!(xml(typed).is_err());
        let deep = format!("{}{}", "<e>".repeat(9_000), "</e>".repeat(9_000));
        assert!(xml(&deep).is_ok());
    }
}

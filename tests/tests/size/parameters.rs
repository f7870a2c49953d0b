//! Parameters of functions, counted in Rust source: also those that a tuple hides.

use dynvox_tests::source::parts;

/// Parameter list of one function.
#[derive(Debug, PartialEq, Eq)]
pub struct ParameterList {
    /// Name of the function.
    pub name: String,
    /// Line of its `fn`, from 1.
    pub line: usize,
    /// Values that a caller hands over: `self` is one, and a tuple counts as its elements.
    pub count: usize,
    /// A parameter is a tuple that the list takes apart, as in `(a, b): (A, B)`.
    pub takes_apart: bool,
}

/// Parameter lists of all functions with a name, bodies or not, in the order of the source.
pub fn parameter_lists(rust: &str) -> Vec<ParameterList> {
    let code: Vec<char> = parts(rust).code.chars().collect();
    let starts = (1..code.len().saturating_sub(3)).filter(|&at| {
        code[at..at + 3] == ['f', 'n', ' '] && !in_name(code[at - 1]) && in_name(code[at + 3])
    });
    starts.filter_map(|at| parameter_list(&code, at)).collect()
}

fn in_name(char: char) -> bool {
    char.is_alphanumeric() || char == '_'
}

/// Parameter list of the function whose `fn` stands at a position.
fn parameter_list(code: &[char], start: usize) -> Option<ParameterList> {
    let name: String = code[start + 3..].iter().take_while(|&&char| in_name(char)).collect();
    let mut at = start + 3 + name.chars().count();
    // Generic parameters may contain parentheses.
    if code.get(at) == Some(&'<') {
        at += length_in_brackets(&code[at..])?;
    }
    if code.get(at) != Some(&'(') {
        return None;
    }
    let list = &code[at + 1..at + length_in_brackets(&code[at..])? - 1];
    let parameters = split(&without_attributes(list));
    Some(ParameterList {
        name,
        line: 1 + code[..start].iter().filter(|&&char| char == '\n').count(),
        count: parameters.iter().map(|parameter| values(parameter)).sum(),
        takes_apart: parameters.iter().any(|parameter| parameter.starts_with('(')),
    })
}

/// Change of the nesting depth at a position; the `>` of an arrow closes nothing.
fn nesting(code: &[char], at: usize) -> i32 {
    match code[at] {
        '(' | '[' | '{' | '<' => 1,
        '>' if at > 0 && code[at - 1] == '-' => 0,
        ')' | ']' | '}' | '>' => -1,
        _ => 0,
    }
}

/// Characters from an opening bracket to its closing one, both included.
fn length_in_brackets(code: &[char]) -> Option<usize> {
    let mut depth = 0;
    (0..code.len())
        .find(|&at| {
            depth += nesting(code, at);
            depth == 0
        })
        .map(|at| at + 1)
}

fn without_attributes(list: &[char]) -> Vec<char> {
    let (mut kept, mut at) = (Vec::new(), 0);
    while at < list.len() {
        match list[at..] {
            ['#', '[', ..] => at += 1 + length_in_brackets(&list[at + 1..]).unwrap_or(1),
            _ => {
                kept.push(list[at]);
                at += 1;
            }
        }
    }
    kept
}

/// Items between the commas of the outermost level, trimmed, without an empty last one.
fn split(list: &[char]) -> Vec<String> {
    let (mut items, mut item, mut depth) = (Vec::new(), String::new(), 0);
    for at in 0..list.len() {
        depth += nesting(list, at);
        if list[at] == ',' && depth == 0 {
            items.push(std::mem::take(&mut item));
        } else {
            item.push(list[at]);
        }
    }
    items.push(item);
    items.iter().map(|item| item.trim().to_owned()).filter(|item| !item.is_empty()).collect()
}

/// Values in one parameter: the elements of its type's tuple or, where an alias names the type, of
/// its pattern; else 1.
fn values(parameter: &str) -> usize {
    let Some((pattern, kind)) = typed(parameter) else { return 1 };
    let kind = without_reference(&kind);
    [kind.as_str(), pattern.as_str()]
        .into_iter()
        .find(|text| text.starts_with('('))
        .map_or(1, |tuple| elements(tuple, tuple == kind).max(1))
}

/// Values in a tuple of types or of patterns.
fn elements(tuple: &str, of_types: bool) -> usize {
    let chars: Vec<char> = tuple.chars().collect();
    let end = length_in_brackets(&chars).unwrap_or(chars.len()) - 1;
    let value = |item: &String| if of_types { values(&format!("_: {item}")) } else { 1 };
    split(&chars[1..end]).iter().map(value).sum()
}

/// Pattern and type of a parameter; `None` for `self`.
fn typed(parameter: &str) -> Option<(String, String)> {
    let chars: Vec<char> = parameter.chars().collect();
    let mut depth = 0;
    let colon = (0..chars.len()).find(|&at| {
        depth += nesting(&chars, at);
        let is_path = chars.get(at + 1) == Some(&':') || (at > 0 && chars[at - 1] == ':');
        chars[at] == ':' && depth == 0 && !is_path
    })?;
    let text = |chars: &[char]| chars.iter().collect::<String>().trim().to_owned();
    Some((text(&chars[..colon]), text(&chars[colon + 1..])))
}

/// A type without the references to it: `(A, B)` of `&'a mut (A, B)`.
fn without_reference(kind: &str) -> String {
    let mut rest = kind.trim();
    while let Some(inner) = rest.strip_prefix('&') {
        rest = inner.trim_start();
        if rest.starts_with('\'') {
            rest = rest.split_once(' ').map_or("", |(_, inner)| inner);
        }
        rest = rest.strip_prefix("mut ").unwrap_or(rest);
    }
    rest.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(rust: &str) -> Vec<(String, usize, bool)> {
        let list = |list: ParameterList| (list.name, list.count, list.takes_apart);
        parameter_lists(rust).into_iter().map(list).collect()
    }

    #[test]
    fn self_counts_and_a_tuple_counts_as_its_elements() {
        let rust = "
fn none() {}
fn plain<T: Fn(u8) -> u8>(&mut self, a: &'a T, f: impl Fn(u8, u8) -> (u8, u8)) {}
fn hidden((a, (b, _)): (u8, (u8, u8)), [c, d]: [u8; 2],) -> (u8, u8) {}
fn kept(pair: &'a mut (u8, u8), unit: ()) {}
fn named((a, b): Pair) {}
// fn comment(a: u8) {}
trait Of { fn declared(#[cfg(a)] a: HashMap<u8, (u8, u8)>, b: a::B); }
";
        let expected = [
            ("none", 0, false),
            ("plain", 3, false),
            ("hidden", 4, true),
            ("kept", 3, false),
            ("named", 2, true),
            ("declared", 2, false),
        ];
        assert_eq!(
            counts(rust),
            expected.map(|(name, count, apart)| (name.to_owned(), count, apart))
        );
    }
}

//! Which channels of a picture are a scene's bands, told by their names.

/// The channels that are bands, in the order of the bands, and what was left out.
#[derive(Debug, PartialEq)]
pub struct Bands {
    /// Indices of the channels.
    pub order: Vec<usize>,
    /// A sentence on channels that are no bands.
    pub note: Option<String>,
}

/// Channels beside colours that are no radiance.
const COVERAGE: [&str; 2] = ["a", "alpha"];
/// Three colours by name, what is likelier first.
const COLOURS: [&[[&str; 3]]; 2] = [&[["r", "g", "b"], ["red", "green", "blue"]], &[["x", "y", "z"]]];

/// The order of the channels `names`: red, green, blue by any of their names, or numbers by value, in names that differ in
/// nothing else. Anything else is refused, for the order of a file's channels is that of the alphabet.
pub fn order(names: &[String]) -> Result<Bands, String> {
    let lower: Vec<String> = names.iter().map(|name| name.to_lowercase()).collect();
    let all: Vec<usize> = (0..names.len()).collect();
    // Names without a layer are those of the picture itself.
    let main: Vec<usize> = all.iter().copied().filter(|i| layer(&names[*i]).is_empty()).collect();
    for channels in [all, main] {
        let found = by_colour(&lower, &channels).or_else(|| by_number(&lower, &channels));
        if let Some((order, known)) = found {
            let left: Vec<&str> =
                (0..names.len()).filter(|i| !known.contains(i)).map(|i| names[i].as_str()).collect();
            let note =
                (!left.is_empty()).then(|| format!("the channels {} are passed over", left.join(", ")));
            return Ok(Bands { order, note });
        }
    }
    let expected = "expected channels called R, G and B, or names that differ by one number alone";
    Err(format!("{expected}, got {}", names.join(", ")))
}

/// What stands before the last point, which is no decimal one.
fn layer(name: &str) -> &str {
    let digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
    let decimal = |at: usize| {
        let word = name[..at].rsplit('.').next().unwrap_or("");
        !word.is_empty() && word.bytes().all(|b| b.is_ascii_digit()) && digit(name[at + 1..].chars().next())
    };
    name.match_indices('.').map(|(at, _)| at).rfind(|at| !decimal(*at)).map_or("", |at| &name[..at])
}

/// Three colours, whatever stands before and behind all of them, and which channels are known with them. `None` where there
/// is no such set, or several.
fn by_colour(lower: &[String], channels: &[usize]) -> Option<(Vec<usize>, Vec<usize>)> {
    let named = |wanted: String| channels.iter().copied().find(|i| lower[*i] == wanted);
    for group in COLOURS {
        let mut found = Vec::new();
        for (colours, first) in group.iter().flat_map(|colours| channels.iter().map(move |i| (colours, *i))) {
            for (at, word) in lower[first].match_indices(colours[0]) {
                let (before, after) = (&lower[first][..at], &lower[first][at + word.len()..]);
                let place = |word: &str| named(format!("{before}{word}{after}"));
                if let (Some(second), Some(third)) = (place(colours[1]), place(colours[2])) {
                    let order = vec![first, second, third];
                    let coverage = COVERAGE.iter().filter_map(|word| place(word));
                    let known = order.iter().copied().chain(coverage).collect();
                    found.push((order, known));
                }
            }
        }
        if found.len() == 1 {
            return found.pop();
        }
        if found.len() > 1 {
            return None;
        }
    }
    None
}

/// One channel, or names that differ by one number: in its order; and which channels are known with them.
fn by_number(lower: &[String], channels: &[usize]) -> Option<(Vec<usize>, Vec<usize>)> {
    let coverage = |i: &usize| {
        let name = &lower[*i];
        COVERAGE.contains(&name[layer(name).len()..].trim_start_matches('.'))
    };
    let mut solid: Vec<usize> = channels.iter().copied().filter(|i| !coverage(i)).collect();
    if solid.is_empty() {
        solid = channels.to_vec();
    }
    let order = match solid[..] {
        [only] => vec![only],
        _ => by_value(&solid.iter().map(|i| lower[*i].as_str()).collect::<Vec<_>>())?
            .into_iter()
            .map(|i| solid[i])
            .collect(),
    };
    Some((order, channels.to_vec()))
}

/// Names that differ by one number: in its order.
fn by_value(names: &[&str]) -> Option<Vec<usize>> {
    let parts: Vec<Vec<Part>> = names.iter().map(|name| split(name)).collect();
    let first = parts.first()?;
    if parts.iter().any(|other| other.len() != first.len()) {
        return None;
    }
    let differs: Vec<usize> =
        (0..first.len()).filter(|at| parts.iter().any(|p| p[*at] != first[*at])).collect();
    let [at] = differs[..] else { return None };
    let mut values: Vec<(f64, usize)> = Vec::new();
    for (index, name) in parts.iter().enumerate() {
        let Part::Number(value) = name[at] else { return None };
        values.push((value, index));
    }
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let equal = values.windows(2).any(|pair| pair[0].0 == pair[1].0);
    (!equal).then(|| values.into_iter().map(|(_, index)| index).collect())
}

#[derive(PartialEq)]
enum Part<'a> {
    Text(&'a str),
    Number(f64),
}

/// A name in pieces of text and of numbers; a decimal point or comma stands between digits, and before it no letter.
fn split(name: &str) -> Vec<Part<'_>> {
    let mut parts = Vec::new();
    let mut rest = name;
    let mut fresh = true;
    while !rest.is_empty() {
        let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
        if digits == 0 {
            let length = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
            parts.push(Part::Text(&rest[..length]));
            fresh = rest[..length].ends_with('.') || rest[..length].ends_with('_');
            rest = &rest[length..];
            continue;
        }
        let mut length = digits;
        let after = &rest[digits..];
        let fraction = after.get(1..).map_or(0, |more| more.bytes().take_while(u8::is_ascii_digit).count());
        if fraction > 0 && (after.starts_with(',') || (fresh && after.starts_with('.'))) {
            length += 1 + fraction;
        }
        // Digits alone are always a number.
        parts.push(Part::Number(rest[..length].replace(',', ".").parse().unwrap_or(f64::NAN)));
        fresh = false;
        rest = &rest[length..];
    }
    parts
}

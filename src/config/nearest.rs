//! Finds the known word most like a misspelt one.

use std::path::Path;

/// Letters that name the beginning of a known word without doubt, and most words named for them.
const BEGINNING: usize = 3;
const WORDS_MAX: usize = 4;

/// Advice on a word that is not known: "; did you mean trot?", or nothing if no known word is near. Known words that begin
/// with it come before a near one.
pub(crate) fn did_you_mean<'k>(word: &str, known: impl Iterator<Item = &'k str> + Clone) -> String {
    advice(word, known, "")
}

/// The same with the suggested words in quotes.
pub(super) fn did_you_mean_quoted<'k>(word: &str, known: impl Iterator<Item = &'k str> + Clone) -> String {
    advice(word, known, "\"")
}

fn advice<'k>(word: &str, known: impl Iterator<Item = &'k str> + Clone, quote: &str) -> String {
    let begins = |known: &&str| word.chars().count() >= BEGINNING && known.starts_with(word);
    let mut meant: Vec<&str> = known.clone().filter(begins).take(WORDS_MAX).collect();
    if meant.is_empty() {
        meant.extend(nearest(word, known));
    }
    let meant: Vec<String> = meant.iter().map(|word| format!("{quote}{word}{quote}")).collect();
    if meant.is_empty() { String::new() } else { format!("; did you mean {}?", meant.join(" or ")) }
}

/// The same for the path of a robot file that is not there: files beside it, and those of the folder `config`.
pub(super) fn did_you_mean_file(path: &Path) -> String {
    let Some(name) = path.file_name().and_then(|name| name.to_str()) else { return String::new() };
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let robots = |folder: &Path| -> Vec<String> {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
        let mut names: Vec<String> = names.filter(|name| name.ends_with(".toml")).collect();
        names.sort();
        names
    };
    for folder in [folder, Path::new("config")] {
        let names = robots(folder);
        let known = names.iter().map(|name| name.strip_suffix(".toml").unwrap_or(name));
        let name = name.strip_suffix(".toml").unwrap_or(name);
        if let Some(found) = known.clone().find(|known| *known == name).or_else(|| nearest(name, known)) {
            return format!("; did you mean {}.toml?", folder.join(found).display());
        }
    }
    String::new()
}

/// The nearest of the known words, if one is near: at most a third of its letters wrong.
pub(crate) fn nearest<'k>(word: &str, known: impl Iterator<Item = &'k str>) -> Option<&'k str> {
    let letters = word.chars().count();
    known
        // Words of very different length cannot be near; this avoids slow comparisons with long ones.
        .filter(|candidate| letters.abs_diff(candidate.chars().count()) <= wrong_at_most(candidate))
        .map(|candidate| (edits(word, candidate), candidate))
        .filter(|(edits, candidate)| *edits <= wrong_at_most(candidate))
        .min_by_key(|(edits, _)| *edits)
        .map(|(_, candidate)| candidate)
}

/// Number of letters of a word that may be wrong.
fn wrong_at_most(word: &str) -> usize {
    (word.chars().count() / 3).max(1)
}

/// Number of letters to insert, delete, change, or swap with the next, to turn one word into the other (optimal string
/// alignment distance).
fn edits(from: &str, to: &str) -> usize {
    let (from, to): (Vec<char>, Vec<char>) = (from.chars().collect(), to.chars().collect());
    let mut before: Vec<usize> = vec![0; to.len() + 1];
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (i, a) in from.iter().enumerate() {
        let mut next = vec![i + 1; to.len() + 1];
        for (j, b) in to.iter().enumerate() {
            let change = row[j] + usize::from(a != b);
            next[j + 1] = change.min(next[j] + 1).min(row[j + 1] + 1);
            if i > 0 && j > 0 && *a == to[j - 1] && from[i - 1] == *b {
                next[j + 1] = next[j + 1].min(before[j - 1] + 1);
            }
        }
        before = std::mem::replace(&mut row, next);
    }
    row[to.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_typing_error_finds_the_intended_word() {
        let keys = ["mass_kg", "range_deg", "link_mm", "id"];
        for (typed, meant) in [
            ("range_rad", Some("range_deg")),
            ("mas_kg", Some("mass_kg")),
            ("links_mm", Some("link_mm")),
            ("colour", None),
            ("", None),
        ] {
            assert_eq!(nearest(typed, keys.into_iter()), meant, "{typed}");
        }
    }

    #[test]
    fn the_beginning_of_known_words_names_them_all() {
        let models = ["STS3215-7V4", "STS3215-12V", "STS3250"];
        let advice = did_you_mean("STS3215", models.into_iter());
        assert_eq!(advice, "; did you mean STS3215-7V4 or STS3215-12V?");
        assert_eq!(did_you_mean("STS3251", models.into_iter()), "; did you mean STS3250?");
        assert_eq!(did_you_mean("MX-28", models.into_iter()), "");
    }

    #[test]
    fn edit_distances_match_known_values() {
        assert_eq!(edits("kitten", "sitting"), 3);
        assert_eq!(edits("tort", "trot"), 1);
        assert_eq!(edits("", "abc"), 3);
        assert_eq!(edits("gallop", "gallop"), 0);
    }
}

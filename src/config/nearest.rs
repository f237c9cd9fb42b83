//! Finds the known word most like a misspelt one.

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

/// Number of letters to insert, delete or change to turn one word into the other (Levenshtein distance).
fn edits(from: &str, to: &str) -> usize {
    let to: Vec<char> = to.chars().collect();
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (i, a) in from.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, b) in to.iter().enumerate() {
            let change = diagonal + usize::from(a != *b);
            diagonal = row[j + 1];
            row[j + 1] = change.min(row[j] + 1).min(diagonal + 1);
        }
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
    fn edit_distances_match_known_values() {
        assert_eq!(edits("kitten", "sitting"), 3);
        assert_eq!(edits("", "abc"), 3);
        assert_eq!(edits("gallop", "gallop"), 0);
    }
}

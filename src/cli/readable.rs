//! Tables in Markdown, laid out for people at a terminal.

/// `text` with each Markdown table as aligned columns: the first to the left, the others to the right.
pub(super) fn readable(text: &str) -> String {
    let mut out = String::new();
    let mut table: Vec<Vec<&str>> = Vec::new();
    for line in text.lines() {
        match cells(line) {
            Some(cells) if cells.iter().all(|cell| !cell.is_empty() && cell.trim_matches('-').is_empty()) => {
            }
            Some(cells) => table.push(cells),
            None => {
                out += &aligned(&std::mem::take(&mut table));
                out += line;
                out.push('\n');
            }
        }
    }
    out + &aligned(&table)
}

/// The cells of a line of a table; `None` for any other line.
fn cells(line: &str) -> Option<Vec<&str>> {
    let inner = line.trim().strip_prefix('|')?.strip_suffix('|')?;
    Some(inner.split('|').map(str::trim).collect())
}

fn aligned(table: &[Vec<&str>]) -> String {
    let width = |column: usize| {
        table.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let mut out = String::new();
    for row in table {
        let line: Vec<String> = row
            .iter()
            .enumerate()
            .map(|(column, cell)| match column {
                0 => format!("{cell:<0$}", width(0)),
                _ => format!("{cell:>0$}", width(column)),
            })
            .collect();
        out += line.join("  ").trim_end();
        out.push('\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_in_markdown_becomes_aligned_columns() {
        let markdown = "Falls:\n\n| push | fell | share |\n|---|---|---|\n| 0.5 N s | 3 | 10 % |\n| 12 N s | 20 | 100 % |\nend";
        let expected = "Falls:\n\npush     fell  share\n0.5 N s     3   10 %\n12 N s     20  100 %\nend\n";
        assert_eq!(readable(markdown), expected);
    }

    #[test]
    fn text_without_a_table_stays_as_it_is() {
        assert_eq!(readable("one\n\n| is no table\n"), "one\n\n| is no table\n");
    }
}

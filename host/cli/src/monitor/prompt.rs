//! Prompts of the monitor: for a vertex, a name, a file, a setting, or a confirmation.

use std::path::PathBuf;

use toposlam::wire::{Command, Name};

use toposlam_link::link::Task;
use toposlam_link::setting;
use toposlam_link::topology::TopologicalMap;

/// A prompt and the text typed so far.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Prompt {
    question: Question,
    text: String,
}

/// The kind of prompt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Question {
    GoTo,
    Name,
    Snapshot,
    Restore,
    Setting,
    Reset,
}

impl Prompt {
    pub(super) const fn new(question: Question) -> Self {
        Self { question, text: String::new() }
    }

    pub(super) fn push(&mut self, character: char) {
        self.text.push(character);
    }

    pub(super) fn pop(&mut self) {
        self.text.pop();
    }

    /// The text of the prompt.
    pub(super) fn question(&self) -> String {
        match self.question {
            Question::GoTo => "go to which vertex? ".to_owned(),
            Question::Name => "VERTEX NAME, without a name to clear it: ".to_owned(),
            Question::Snapshot => "snapshot to which file [--force]? ".to_owned(),
            Question::Restore => "restore from which file? ".to_owned(),
            Question::Setting => "set NAME VALUE: ".to_owned(),
            Question::Reset => "forget the whole map? type yes: ".to_owned(),
        }
    }

    pub(super) fn text(&self) -> &str {
        &self.text
    }

    /// The task for the typed text, or why the text is invalid. Vertices are those of `map`.
    pub(super) fn answer(&self, map: &TopologicalMap) -> Result<Task, String> {
        let text = self.text.trim();
        if text.is_empty() {
            return Err("nothing was typed".to_owned());
        }
        match self.question {
            Question::GoTo => {
                let vertex = map.find_vertex(text).ok_or_else(|| format!("the map has no vertex `{text}`"))?;
                Ok(Task::Command(Command::GoTo { vertex }))
            }
            Question::Name => {
                let (vertex, name) = text.split_once(' ').unwrap_or((text, ""));
                // A name may have spaces: a known one counts as a whole.
                let (vertex, name) = if map.find_vertex(text).is_some() { (text, "") } else { (vertex, name.trim()) };
                let vertex = map.find_vertex(vertex).ok_or_else(|| format!("the map has no vertex `{vertex}`"))?;
                let name = if name.is_empty() { Ok(Name::NONE) } else { Name::new(name) };
                Ok(Task::Command(Command::Name { vertex, name: name.map_err(|error| error.to_string())? }))
            }
            Question::Snapshot => {
                let (file, force) = text.strip_suffix(" --force").map_or((text, false), |file| (file.trim_end(), true));
                Ok(Task::Snapshot { file: PathBuf::from(file), force })
            }
            Question::Restore => Ok(Task::Restore(PathBuf::from(text))),
            Question::Setting => {
                let (name, value) = text.split_once(' ').ok_or("a setting needs a name and a value")?;
                let value = value.trim().parse().map_err(|_| format!("`{value}` is no number from 0 to 65535"))?;
                let setting = setting::named(name, value)
                    .ok_or_else(|| format!("no setting `{name}`; {}", setting::NAMES.join(", ")))?;
                Ok(Task::Command(Command::SetConfig(setting)))
            }
            Question::Reset if text == "yes" => Ok(Task::Command(Command::Reset)),
            Question::Reset => Err("not reset".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toposlam::wire::Setting;
    use toposlam_link::topology::Vertex;

    fn answer(question: Question, text: &str) -> Result<Task, String> {
        let mut prompt = Prompt::new(question);
        text.chars().for_each(|character| prompt.push(character));
        prompt.answer(&map())
    }

    fn map() -> TopologicalMap {
        let names = [(1, "hall".to_owned()), (2, "far end".to_owned())].into();
        TopologicalMap { vertices: vec![Vertex::default(); 4], names, ..TopologicalMap::default() }
    }

    #[test]
    fn a_typed_answer_becomes_a_task_or_an_error() {
        assert_eq!(answer(Question::GoTo, "3"), Ok(Task::Command(Command::GoTo { vertex: 3 })));
        assert_eq!(answer(Question::GoTo, "hall"), Ok(Task::Command(Command::GoTo { vertex: 1 })));
        assert!(answer(Question::GoTo, "256").unwrap_err().contains("256"));
        assert!(answer(Question::GoTo, "cellar").unwrap_err().contains("no vertex `cellar`"));
        let named = |vertex, name| Ok(Task::Command(Command::Name { vertex, name }));
        assert_eq!(answer(Question::Name, "3 far hall"), named(3, Name::new("far hall").unwrap()));
        assert_eq!(answer(Question::Name, "hall lobby"), named(1, Name::new("lobby").unwrap()));
        assert_eq!(answer(Question::Name, "far end"), named(2, Name::NONE));
        assert!(answer(Question::Name, "3 4").unwrap_err().contains("number"));
        assert!(answer(Question::Name, "cellar hall").unwrap_err().contains("no vertex `cellar`"));
        assert_eq!(answer(Question::Snapshot, " a b "), Ok(Task::Snapshot { file: "a b".into(), force: false }));
        let replacing = Task::Snapshot { file: "a b".into(), force: true };
        assert_eq!(answer(Question::Snapshot, "a b  --force"), Ok(replacing));
        assert!(answer(Question::Restore, " ").is_err());
        let set = Task::Command(Command::SetConfig(Setting::NoiseMm(40)));
        assert_eq!(answer(Question::Setting, "noise-mm  40"), Ok(set));
        for wrong in ["noise-mm", "noise-mm 70000", "colour 3"] {
            assert!(answer(Question::Setting, wrong).is_err(), "{wrong}");
        }
        assert_eq!(answer(Question::Reset, "yes"), Ok(Task::Command(Command::Reset)));
        assert!(answer(Question::Reset, "y").is_err());
    }
}

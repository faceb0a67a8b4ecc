//! Attaches to an osteon coordinator, runs batches of realizations on its cores, answers.

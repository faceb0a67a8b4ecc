//! Posteriors of models that are known in closed form.

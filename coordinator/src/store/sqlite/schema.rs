//! The tables, and the way from older formats to this one.

/// Tables of a new file.
pub(super) const SCHEMA: &str = "
    CREATE TABLE job (
        id INTEGER PRIMARY KEY,
        request_id TEXT NOT NULL,
        accepted_ns INTEGER NOT NULL,    -- since the Unix epoch
        specification BLOB NOT NULL,     -- osteon.v1.JobSpecification
        fingerprint TEXT NOT NULL,       -- of the numerics of its evaluations
        checksum BLOB NOT NULL,
        client TEXT NOT NULL DEFAULT '',
        priority INTEGER NOT NULL DEFAULT 0,
        name TEXT NOT NULL DEFAULT ''    -- what people call it
    );
    CREATE TABLE evaluation (
        job INTEGER NOT NULL REFERENCES job(id),
        number INTEGER NOT NULL,
        point BLOB NOT NULL,             -- seven little-endian f64
        outcomes BLOB NOT NULL,          -- per index: code byte, velocity as little-endian f64
        checksum BLOB NOT NULL,
        estimated_error BLOB,            -- of the successes: median, largest, as little-endian f64
        workers TEXT,                    -- whose answers are in it: a line each, PROCESS[/INSTANCE] HOST
        PRIMARY KEY (job, number)
    );
    CREATE TABLE ending (
        job INTEGER PRIMARY KEY REFERENCES job(id),
        status TEXT NOT NULL,
        reason TEXT,
        version TEXT NOT NULL,
        ended_ns INTEGER NOT NULL,
        evaluations INTEGER NOT NULL,
        best_cost REAL,
        best_mean REAL,
        best_coefficient_of_variation REAL,
        checksum BLOB NOT NULL
    );
    CREATE TABLE summary (               -- what an ended job's path came to
        job INTEGER PRIMARY KEY REFERENCES job(id),
        digest TEXT NOT NULL,
        best INTEGER,                    -- number of the best evaluation
        history BLOB NOT NULL,           -- osteon.v1.HistoryBlock
        checksum BLOB NOT NULL
    );
    CREATE TABLE expulsion (             -- workers that were found to compute wrongly
        number INTEGER PRIMARY KEY,
        host TEXT NOT NULL,
        process INTEGER NOT NULL,
        job INTEGER NOT NULL,            -- in which it was found
        reason TEXT NOT NULL,
        at_ns INTEGER NOT NULL,          -- since the Unix epoch
        checksum BLOB NOT NULL,
        instance INTEGER NOT NULL DEFAULT 0  -- the number it drew, as a signed one
    );
";

/// From format 2, which knew no estimated errors. The checksum of a row without one is the same.
pub(super) const FROM_FORMAT_2: &str = "
    ALTER TABLE evaluation ADD COLUMN estimated_error BLOB;
    UPDATE format SET version = 3;
";

/// From format 3, which knew no clients, no priorities, and not who computed what. The checksum
/// of a row with neither is the same.
pub(super) const FROM_FORMAT_3: &str = "
    ALTER TABLE job ADD COLUMN client TEXT NOT NULL DEFAULT '';
    ALTER TABLE job ADD COLUMN priority INTEGER NOT NULL DEFAULT 0;
    ALTER TABLE evaluation ADD COLUMN workers TEXT;
    CREATE TABLE expulsion (
        number INTEGER PRIMARY KEY,
        host TEXT NOT NULL,
        process INTEGER NOT NULL,
        job INTEGER NOT NULL,
        reason TEXT NOT NULL,
        at_ns INTEGER NOT NULL,
        checksum BLOB NOT NULL
    );
    UPDATE format SET version = 4;
";

/// From format 4, which knew a worker by host and process alone. The checksum of a row without an
/// instance is the same.
pub(super) const FROM_FORMAT_4: &str = "
    ALTER TABLE expulsion ADD COLUMN instance INTEGER NOT NULL DEFAULT 0;
    ALTER TABLE job ADD COLUMN name TEXT NOT NULL DEFAULT '';
    UPDATE format SET version = 5;
";

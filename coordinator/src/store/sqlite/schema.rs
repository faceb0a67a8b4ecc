//! The tables.

/// Tables of a new file.
pub(super) const SCHEMA: &str = "
    CREATE TABLE job (
        id INTEGER PRIMARY KEY,
        request_id TEXT NOT NULL,
        accepted_ns INTEGER NOT NULL,    -- since the Unix epoch
        specification BLOB NOT NULL,     -- osteon.v1.JobSpecification
        fingerprint TEXT NOT NULL,       -- of the numerics of its evaluations
        client TEXT NOT NULL,
        priority INTEGER NOT NULL,
        name TEXT NOT NULL,              -- for display
        checksum BLOB NOT NULL
    );
    CREATE TABLE evaluation (
        job INTEGER NOT NULL REFERENCES job(id),
        number INTEGER NOT NULL,
        point BLOB NOT NULL,             -- little-endian f64: seven, or more if a quantity of the setup is searched
        outcomes BLOB NOT NULL,          -- per index: code byte, velocity as little-endian f64
        estimated_error BLOB,            -- of the successes: median, largest, as little-endian f64
        workers TEXT NOT NULL,           -- whose answers are in it: a line each, PROCESS/INSTANCE HOST
        checksum BLOB NOT NULL,
        PRIMARY KEY (job, number)
    );
    CREATE TABLE ending (
        job INTEGER PRIMARY KEY REFERENCES job(id),
        status TEXT NOT NULL,
        failure TEXT,                    -- of which kind it is
        reason TEXT,
        version TEXT NOT NULL,           -- of the program
        numerics INTEGER NOT NULL,       -- revision of that program's numerics
        commit_id TEXT,                  -- that it was built from
        ended_ns INTEGER NOT NULL,
        evaluations INTEGER NOT NULL,
        best_cost REAL,
        best_mean REAL,
        best_coefficient_of_variation REAL,
        checksum BLOB NOT NULL
    );
    CREATE TABLE summary (               -- results of an ended job
        job INTEGER PRIMARY KEY REFERENCES job(id),
        digest TEXT NOT NULL,
        best INTEGER,                    -- number of the best evaluation
        history BLOB NOT NULL,           -- osteon.v1.HistoryBlock
        checksum BLOB NOT NULL
    );
    CREATE TABLE ban (                    -- hosts of workers that were found to compute wrongly
        number INTEGER PRIMARY KEY,
        host TEXT NOT NULL,
        process INTEGER NOT NULL,
        instance INTEGER NOT NULL,       -- random number that the process drew at its start; a u64 as i64
        job INTEGER NOT NULL,            -- in which it was found
        reason TEXT NOT NULL,
        at_ns INTEGER NOT NULL,          -- since the Unix epoch
        checksum BLOB NOT NULL
    );
";

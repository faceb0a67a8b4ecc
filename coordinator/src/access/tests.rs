use std::collections::BTreeSet;

use osteon_proto::v1;
use prost::Message as _;
use prost_types::FileDescriptorSet;
use tonic::{Code, Status};

use super::*;

/// Every method and its requirement.
const NEEDS: [(&str, Requirement); 17] = [
    ("/grpc.health.v1.Health/Check", Requirement::Nothing),
    ("/osteon.v1.Jobs/Get", Requirement::Role(Role::Read)),
    ("/osteon.v1.Jobs/List", Requirement::Role(Role::Read)),
    ("/osteon.v1.Jobs/ListBans", Requirement::Role(Role::Read)),
    ("/osteon.v1.Jobs/Explain", Requirement::Role(Role::Read)),
    ("/osteon.v1.Jobs/ListWorkers", Requirement::Role(Role::Read)),
    ("/osteon.v1.Jobs/Watch", Requirement::Role(Role::Read)),
    ("/osteon.v1.Jobs/Fetch", Requirement::Role(Role::Read)),
    ("/osteon.v1.Jobs/Submit", Requirement::Role(Role::Submit)),
    ("/osteon.v1.Jobs/Cancel", Requirement::Role(Role::Submit)),
    ("/osteon.v1.Jobs/Recheck", Requirement::Role(Role::Submit)),
    ("/osteon.v1.Jobs/Prune", Requirement::Role(Role::Admin)),
    ("/osteon.v1.Jobs/LiftBan", Requirement::Role(Role::Admin)),
    ("/osteon.v1.Jobs/DrainWorker", Requirement::Role(Role::Admin)),
    ("/osteon.v1.Jobs/Backup", Requirement::Role(Role::Admin)),
    ("/osteon.v1.Workers/Attach", Requirement::Worker),
    ("/grpc.reflection.v1.ServerReflection/ServerReflectionInfo", Requirement::Known),
];

#[test]
fn every_method_asks_for_something() {
    for (path, expected) in NEEDS {
        assert_eq!(requirement(path), expected, "{path}");
    }
    for (path, expected) in [
        // A method that is added later has the strictest requirement until one is chosen for it.
        ("/osteon.v1.Jobs/Later", Requirement::Role(Role::Admin)),
        ("/osteon.v1.Workers/Later", Requirement::Worker),
        ("/osteon.v1.Else/Get", Requirement::Known),
        ("/grpc.health.v1.Healthy/Check", Requirement::Known),
        ("/osteon.v1.Jobs", Requirement::Known),
        ("//grpc.health.v1.Health/Check", Requirement::Known),
        ("/", Requirement::Known),
        ("", Requirement::Known),
    ] {
        assert_eq!(requirement(path), expected, "{path}");
    }
}

#[test]
fn no_method_of_the_services_escaped_the_table() {
    let set = FileDescriptorSet::decode(v1::FILE_DESCRIPTOR_SET).unwrap();
    let mut methods = BTreeSet::new();
    for file in set.file.iter().filter(|file| file.package() == "osteon.v1") {
        for service in &file.service {
            for method in &service.method {
                methods.insert(format!("/osteon.v1.{}/{}", service.name(), method.name()));
            }
        }
    }
    assert!(methods.len() >= 7, "{methods:?}");
    for method in methods {
        let listed = NEEDS.iter().any(|(path, _)| *path == method);
        assert!(listed, "decide who may call {method}");
    }
}

/// Returns a list with one token of each role, and the tokens.
fn tokens() -> (Tokens, [Token; 3]) {
    let roles = [Role::Read, Role::Submit, Role::Admin];
    let made = roles.map(|_| Token::generate().unwrap());
    let mut text = String::new();
    for (role, token) in roles.iter().zip(&made) {
        text += &(crate::access::tokens::line(&format!("{}er", role.name()), *role, &token.hash())
            + "\n");
    }
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("tokens");
    std::fs::write(&path, text).unwrap();
    let mode = std::os::unix::fs::PermissionsExt::from_mode(0o600);
    std::fs::set_permissions(&path, mode).unwrap();
    (Tokens::read(&path).unwrap(), made)
}

/// Returns `Ok`, or the code of the refusal.
fn code(
    policy: &Policy,
    certificate: Certificate,
    presented: Presented<'_>,
    need: Requirement,
) -> Result<(), Code> {
    let decided = decide(policy, certificate, presented, need);
    decided.map(drop).map_err(|denied| Status::from(denied).code())
}

#[test]
fn who_may_call_what_is_a_table() {
    use Code::{PermissionDenied as Weak, Unauthenticated as Unknown};
    let (list, [read, submit, admin]) = tokens();
    let stranger = Token::generate().unwrap();
    let callers: [(&str, Presented<'_>); 6] = [
        ("nothing", Presented::Nothing),
        ("unreadable", Presented::Unreadable),
        ("stranger", Presented::Token(stranger.reveal())),
        ("read", Presented::Token(read.reveal())),
        ("submit", Presented::Token(submit.reveal())),
        ("admin", Presented::Token(admin.reveal())),
    ];
    let none = [Err(Unknown), Err(Unknown), Err(Unknown)];
    let answers = |rest: [Result<(), Code>; 3]| [none, rest].concat();
    let table = [
        (Requirement::Nothing, vec![Ok(()); 6]),
        (Requirement::Known, answers([Ok(()); 3])),
        (Requirement::Role(Role::Read), answers([Ok(()); 3])),
        (Requirement::Role(Role::Submit), answers([Err(Weak), Ok(()), Ok(())])),
        (Requirement::Role(Role::Admin), answers([Err(Weak), Err(Weak), Ok(())])),
    ];
    for policy in [Policy::Tokens(list.clone()), Policy::Tls(list.clone())] {
        for (need, expected) in &table {
            for ((name, presented), expected) in callers.iter().zip(expected) {
                let found = code(&policy, Certificate::Absent, *presented, *need);
                assert_eq!(found, *expected, "{need:?} {name}");
            }
        }
    }
    for (name, presented) in callers {
        for need in NEEDS.map(|(_, need)| need) {
            let found = code(&Policy::Everybody, Certificate::Absent, presented, need);
            assert_eq!(found, Ok(()), "{need:?} {name}");
        }
        // Without TLS there are no certificates, and only an administrator is trusted as a worker.
        let found = code(
            &Policy::Tokens(list.clone()),
            Certificate::Absent,
            presented,
            Requirement::Worker,
        );
        let expected = match name {
            "admin" => Ok(()),
            "read" | "submit" => Err(Weak),
            _ => Err(Unknown),
        };
        assert_eq!(found, expected, "{name}");
    }
}

#[test]
fn a_certificate_makes_a_worker_and_nothing_else() {
    let (list, [.., admin]) = tokens();
    let policy = Policy::Tls(list);
    let faulty = Certificate::Faulty(Fault::Expired);
    for presented in [Presented::Nothing, Presented::Unreadable, Presented::Token(admin.reveal())] {
        for (certificate, expected) in [
            (Certificate::Worker, Ok(())),
            (Certificate::Other, Err(Code::PermissionDenied)),
            // A token does not replace a certificate.
            (Certificate::Absent, Err(Code::Unauthenticated)),
            (faulty, Err(Code::Unauthenticated)),
        ] {
            let found = code(&policy, certificate, presented, Requirement::Worker);
            assert_eq!(found, expected, "{certificate:?} {presented:?}");
        }
    }
    // Nor does a certificate replace a token.
    for certificate in [Certificate::Worker, Certificate::Other] {
        for role in [Role::Read, Role::Submit, Role::Admin] {
            let found = code(&policy, certificate, Presented::Nothing, Requirement::Role(role));
            assert_eq!(found, Err(Code::Unauthenticated), "{certificate:?} {role:?}");
        }
        assert_eq!(code(&policy, certificate, Presented::Nothing, Requirement::Known), Ok(()));
    }
    // A caller whose certificate is not valid receives that reason, whatever its token.
    let token = Presented::Token(admin.reveal());
    for need in [Requirement::Known, Requirement::Role(Role::Read), Requirement::Role(Role::Admin)]
    {
        assert_eq!(code(&policy, faulty, token, need), Err(Code::Unauthenticated), "{need:?}");
    }
    assert_eq!(code(&policy, faulty, Presented::Nothing, Requirement::Nothing), Ok(()));
}

#[test]
fn headers_are_tokens_or_not() {
    let token = Token::generate().unwrap();
    let text = token.reveal();
    for (header, expected) in [
        (None, Presented::Nothing),
        (Some(format!("Bearer {text}")), Presented::Token(text)),
        (Some(format!("bearer {text}")), Presented::Token(text)),
        (Some(text.to_owned()), Presented::Unreadable),
        (Some(format!("Basic {text}")), Presented::Unreadable),
        (Some("Bearer ".to_owned()), Presented::Unreadable),
        (Some("Bearer secret".to_owned()), Presented::Unreadable),
        (Some(String::new()), Presented::Unreadable),
    ] {
        let found = presented(header.as_deref().map(str::as_bytes));
        assert_eq!(found, expected, "{header:?}");
    }
    assert_eq!(presented(Some(b"Bearer \xff")), Presented::Unreadable);
}

#[test]
fn the_page_is_for_everybody_and_its_data_need_the_role_of_the_api() {
    for (path, requirement) in [
        ("/", Requirement::Nothing),
        ("/page.js", Requirement::Nothing),
        ("/events", Requirement::Role(Role::Read)),
        ("/data/overview", Requirement::Role(Role::Read)),
        ("/data/jobs", Requirement::Role(Role::Read)),
        ("/data/jobs/7", Requirement::Role(Role::Read)),
        ("/data/jobs/7/figures", Requirement::Role(Role::Read)),
        ("/data/jobs/7/cancel", Requirement::Role(Role::Submit)),
        ("/data/new", Requirement::Known),
        ("//", Requirement::Known),
    ] {
        assert_eq!(page_requirement(path), requirement, "{path}");
    }
}

//! The binary `dynvox`.

fn main() -> std::process::ExitCode {
    dynvox::cli::main()
}

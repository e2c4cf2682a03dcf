// manual_command.cpp: clamor manual: writes the man pages and shell completions, from the options
// that the commands declare. The build runs it; --help does not list it.
#include <filesystem>
#include <fstream>
#include <ostream>

#include "tools/commands/commands.h"
#include "tools/program/arguments.h"

namespace clamor {

namespace {

Result<void> write(const std::filesystem::path& path, const std::string& text) {
  std::error_code ignored;  // opening the file reports it
  std::filesystem::create_directories(path.parent_path(), ignored);
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) return Error(path.string() + " cannot be written");
  return {};
}

}  // namespace

int run_manual(std::span<const CommandDescription> commands, std::span<const std::string> arguments,
               std::ostream& out, std::ostream& err) {
  std::string folder;
  Arguments parser("manual",
                   "Writes man pages and completions for bash, zsh and fish to the folders where "
                   "systems look for them below FOLDER.",
                   "clamor manual ~/.local/share");
  parser.positional("FOLDER", folder, "as in /usr/local/share");
  if (const auto code = parser.parse(arguments, out, err)) return *code;

  const std::filesystem::path share(folder);
  std::vector<std::pair<std::string, std::string>> files = {
      {"man/man1/clamor.1", man_page(commands)},
      {"bash-completion/completions/clamor", bash_completion(commands)},
      {"zsh/site-functions/_clamor", zsh_completion(commands)},
      {"fish/vendor_completions.d/clamor.fish", fish_completion(commands)}};
  for (const CommandDescription& command : commands)
    files.emplace_back("man/man1/" + man_page_name(command) + ".1", man_page(command));
  Result<void> written;
  for (const auto& [name, text] : files)
    if (written.ok()) written = write(share / name, text);
  return parser.end(err, written);
}

}  // namespace clamor

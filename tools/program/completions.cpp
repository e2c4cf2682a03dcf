// completions.cpp: completions for bash, zsh and fish.
#include <algorithm>
#include <map>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tools/program/command_description.h"
#include "tools/program/shell_quote.h"

namespace clamor {

namespace {

// The beginning of a help text, which fits beside the option in a list.
std::string brief(const std::string& help) {
  return help.substr(0, std::min(help.find("; "), help.find(" [")));
}

// The options of the program itself.
constexpr const char* kHelpOptions = "--help --version";

std::string positional_words(const CommandDescription& command) {
  return command.positionals.empty()
             ? ""
             : fmt::format("{}", fmt::join(command.positionals[0].words, " "));
}

// The words of "farm status" are "farm" and "status".
std::string first_word(const CommandDescription& command) {
  return command.name.substr(0, command.name.find(' '));
}
std::string last_word(const CommandDescription& command) {
  return command.name.substr(command.name.find(' ') + 1);
}

// The last words of the subcommands of each command, separated by blanks.
std::map<std::string, std::string> words_of_commands(std::span<const CommandDescription> commands) {
  std::map<std::string, std::string> words;
  for (const CommandDescription& command : commands) {
    if (!command.is_subcommand()) continue;
    std::string& of_command = words[first_word(command)];
    of_command += (of_command.empty() ? "" : " ") + last_word(command);
  }
  return words;
}

// A pattern of a shell's case for a command's name.
std::string case_of(const CommandDescription& command) {
  return command.is_subcommand() ? "'" + command.name + "'" : command.name;
}

// zsh's _arguments ends a description at a bracket or colon, unless a backslash is before it.
std::string zsh_escaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') escaped += '\\';
    escaped += c;
  }
  return escaped;
}

std::string zsh_action(const OptionDescription& option) {
  return option.words.empty() ? "_files" : fmt::format("({})", fmt::join(option.words, " "));
}

// A specification for each option, and one for each positional.
std::string zsh_specifications(const CommandDescription& command) {
  std::string text;
  for (const OptionDescription& option : command.options) {
    const std::string all = fmt::format("{}", fmt::join(option.names, " "));
    for (const std::string& name : option.names) {
      const std::string once = option.repeatable ? "*" : "(" + all + ")";
      const std::string value =
          option.value.empty() ? "" : ":" + option.value + ":" + zsh_action(option);
      text += " \\\n      " +
              shell_quoted(once + name + "[" + zsh_escaped(brief(option.help)) + "]" + value);
    }
  }
  for (const OptionDescription& word : command.positionals)
    text += " \\\n      " + shell_quoted((word.repeatable ? "*:" : ":") +
                                         zsh_escaped(word.names.front()) + ":" + zsh_action(word));
  return text;
}

}  // namespace

std::string bash_completion(std::span<const CommandDescription> commands) {
  std::string names, cases, selections;
  const auto words_after = words_of_commands(commands);
  for (const auto& [command, words] : words_after)
    selections += fmt::format(
        "  if [[ $command == {0} ]]; then\n"
        "    for word in {1}; do\n"
        "      ((COMP_CWORD > 2)) && [[ ${{COMP_WORDS[2]}} == \"$word\" ]] && command=\"{0} "
        "$word\"\n"
        "    done\n"
        "  fi\n",
        command, words);
  for (const CommandDescription& command : commands) {
    if (!command.is_subcommand()) names += command.name + " ";
    std::string options, values;
    for (const OptionDescription& option : command.options) {
      options += fmt::format("{}{}", options.empty() ? "" : " ", fmt::join(option.names, " "));
      if (!option.value.empty())
        values += fmt::format("      {}) words='{}' options='' ;;\n",
                              fmt::join(option.names, " | "), fmt::join(option.words, " "));
    }
    cases += fmt::format("    {})\n      options='{}'\n      words='{}'\n", case_of(command),
                         options, positional_words(command));
    if (const auto found = words_after.find(command.name); found != words_after.end())
      cases += "      ((COMP_CWORD == 2)) && words='" + found->second + "'\n";
    if (!values.empty()) cases += "      case $previous in\n" + values + "      esac\n";
    cases += "      ;;\n";
  }
  return "# bash completion for clamor\n"
         "_clamor() {\n"
         "  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]}\n"
         "  local options='' words='' word command=${COMP_WORDS[1]}\n"
         "  # Bash takes --option=value for three words.\n"
         "  [[ $current == = ]] && current=''\n"
         "  [[ $previous == = ]] && previous=${COMP_WORDS[COMP_CWORD - 2]}\n" +
         selections +
         "  if ((COMP_CWORD == 1)); then\n"
         "    words='" +
         names + kHelpOptions +
         "'\n"
         "  else\n"
         "    case $command in\n" +
         cases +
         "    esac\n"
         "  fi\n"
         "  [[ $current == -* && -n $options ]] && words=$options\n"
         "  # Without words, bash completes file names.\n"
         "  mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$current\")\n"
         "}\n"
         "complete -o bashdefault -o default -F _clamor clamor\n";
}

std::string zsh_completion(std::span<const CommandDescription> commands) {
  std::string names, cases, selections;
  for (const CommandDescription& command : commands) {
    if (!command.is_subcommand())
      names += "    " + shell_quoted(command.name + ":" + zsh_escaped(command.summary)) + "\n";
    cases +=
        fmt::format("    {}) _arguments{} ;;\n", case_of(command), zsh_specifications(command));
  }
  for (const auto& [command, words] : words_of_commands(commands))
    selections += fmt::format(
        "  if [[ $command == {0} ]]; then\n"
        "    if ((CURRENT == 2)); then\n"
        "      compadd -- {1}\n"
        "    elif [[ ' {1} ' == *\" $words[2] \"* ]]; then\n"
        "      command=\"{0} $words[2]\"\n"
        "      shift words\n"
        "      ((CURRENT--))\n"
        "    fi\n"
        "  fi\n",
        command, words);
  return "#compdef clamor\n"
         "_clamor() {\n"
         "  local -a commands=(\n" +
         names +
         "  )\n"
         "  if ((CURRENT == 2)); then\n"
         "    _describe -t commands command commands\n"
         "    compadd -- " +
         kHelpOptions +
         "\n"
         "    return\n"
         "  fi\n"
         "  shift words\n"
         "  ((CURRENT--))\n"
         "  local command=$words[1]\n" +
         selections + "  case $command in\n" + cases +
         "  esac\n"
         "}\n"
         "_clamor \"$@\"\n";
}

std::string fish_completion(std::span<const CommandDescription> commands) {
  std::string text = "# fish completion for clamor\n";
  const std::string first = "complete -c clamor -n __fish_use_subcommand ";
  text += first + "-f -l help -d 'print all commands'\n";
  text += first + "-f -l version -d 'print the version'\n";
  const std::string seen = "__fish_seen_subcommand_from ";
  const auto words_after = words_of_commands(commands);
  // Adds the words and options of a command, where a condition holds.
  const auto add = [&text](const CommandDescription& command, const std::string& condition) {
    const std::string within = "complete -c clamor -n '" + condition + "'";
    if (const std::string words = positional_words(command); !words.empty())
      text += within + " -a " + shell_quoted(words) + "\n";
    for (const OptionDescription& option : command.options) {
      text += within;
      for (const std::string& name : option.names)
        text += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      if (!option.words.empty())
        text += fmt::format(" -x -a '{}'", fmt::join(option.words, " "));
      else if (!option.value.empty())
        text += " -r -F";
      else
        text += " -f";
      text += " -d " + shell_quoted(brief(option.help)) + "\n";
    }
  };
  for (const CommandDescription& command : commands) {
    if (command.is_subcommand()) continue;
    text += first + fmt::format("-f -a {} -d {}\n", command.name, shell_quoted(command.summary));
    std::string others;  // words by which the line is that of another command
    if (const auto found = words_after.find(command.name); found != words_after.end())
      others = found->second;
    for (const CommandDescription& other : commands)
      if (other.is_subcommand() && last_word(other) == command.name) others = first_word(other);
    add(command, (others.empty() ? "" : "not " + seen + others + "; and ") + seen + command.name);
  }
  for (const CommandDescription& command : commands) {
    if (!command.is_subcommand()) continue;
    const std::string parent = first_word(command);
    text += "complete -c clamor -n 'not " + seen + words_after.at(parent) + "; and " + seen +
            parent + "' -a " + last_word(command) + " -d " + shell_quoted(command.summary) + "\n";
    add(command, seen + parent + "; and " + seen + last_word(command));
  }
  return text;
}

}  // namespace clamor

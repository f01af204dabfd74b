#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace touchfield {

/// Help of commands and options in 80 columns, with the values of an option as a user types them: `--pictures png|pdf`,
/// `--threads N`.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option(const CLI::Option* option, bool is_positional) const override;
  std::string make_subcommand(const CLI::App* command) const override;
  std::string make_description(const CLI::App* app) const override;
};

}  // namespace touchfield

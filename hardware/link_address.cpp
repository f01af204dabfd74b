#include "hardware/link_address.h"

#include <map>
#include <string_view>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/text.h"

namespace touchfield {

namespace {

constexpr const char* kForms =
    "dry-run[:FILE][?levels=256], sonicsurface:PORT[?firmware=primary|secondary|tactile&order=fpga|natural], "
    "autd3-udp, autd3-udp:INTERFACE or autd3-udp:HOST:PORT";

/// A link text cut into its parts, and the refusals that quote it.
struct LinkText {
  explicit LinkText(const std::string& whole) : text(whole) {
    std::string_view rest = text;
    const auto question = rest.find('?');
    if (question != std::string_view::npos) {
      read_options(rest.substr(question + 1));
      rest = rest.substr(0, question);
    }
    const auto colon = rest.find(':');
    scheme = rest.substr(0, colon);
    place = colon == std::string_view::npos ? "" : std::string(rest.substr(colon + 1));
  }

  void read_options(std::string_view query) {
    while (!query.empty()) {
      const auto end = query.find('&');
      const std::string_view option = query.substr(0, end);
      query.remove_prefix(end == std::string_view::npos ? query.size() : end + 1);
      const auto equals = option.find('=');
      if (equals == std::string_view::npos) refuse(fmt::format("option '{}' must be KEY=VALUE", option));
      if (!options.emplace(option.substr(0, equals), option.substr(equals + 1)).second) {
        refuse(fmt::format("option {} is there twice", option.substr(0, equals)));
      }
    }
  }

  [[noreturn]] void refuse(const std::string& what) const {
    throw InputError(fmt::format("link '{}': {}", text, what));
  }

  /// Takes an option out; what is left over at the end is refused.
  std::string take(const char* key, const char* fallback) {
    const auto found = options.find(key);
    if (found == options.end()) return fallback;
    std::string value = found->second;
    options.erase(found);
    return value;
  }

  template <class T>
  T choice(const char* key, const char* fallback, const std::map<std::string, T>& choices) {
    const std::string value = take(key, fallback);
    const auto found = choices.find(value);
    if (found != choices.end()) return found->second;
    std::string known;
    for (const auto& [name, unused] : choices) known += (known.empty() ? "" : ", ") + name;
    refuse(fmt::format("{} = '{}' must be one of {}", key, value, known));
  }

  int number(const char* what, std::string_view value, int least, int most) const {
    const auto parsed = number_of<int>(value);
    if (!parsed || *parsed < least || *parsed > most) {
      refuse(fmt::format("{} = '{}' must be a whole number from {} to {}", what, value, least, most));
    }
    return *parsed;
  }

  std::string text;
  std::string scheme;
  std::string place;  // after the first colon
  std::map<std::string, std::string> options;
};

// HOST:PORT; the host of the form [HOST] may hold colons.
void read_host(LinkText& link, const std::string& where, LinkAddress& address) {
  const auto last = where.rfind(':');
  address.host = where.substr(0, last);
  const bool brackets = address.host.starts_with('[') && address.host.ends_with(']');
  if (brackets) {
    address.host = address.host.substr(1, address.host.size() - 2);
  }
  if (address.host.empty() || where.ends_with(']') || (!brackets && address.host.find(':') != std::string::npos)) {
    link.refuse("must be autd3-udp:HOST:PORT, e.g. autd3-udp:[::1]:8080");
  }
  address.port = link.number("the port", std::string_view(where).substr(last + 1), 1, 65535);
}

}  // namespace

LinkAddress parse_link_address(const std::string& text) {
  LinkText link(text);
  LinkAddress address;
  if (link.scheme == "dry-run") {
    address.kind = LinkAddress::Kind::kDryRun;
    address.path = link.place;
    address.levels = link.number("levels", link.take("levels", "256"), 2, 256);
  } else if (link.scheme == "sonicsurface") {
    address.kind = LinkAddress::Kind::kSonicsurface;
    address.path = link.place;
    if (address.path.empty()) link.refuse("must be sonicsurface:PORT, e.g. sonicsurface:/dev/ttyUSB0");
    address.firmware = link.choice<SonicsurfaceFirmware>("firmware", "primary",
                                                         {{"primary", SonicsurfaceFirmware::kPrimary},
                                                          {"secondary", SonicsurfaceFirmware::kSecondary},
                                                          {"tactile", SonicsurfaceFirmware::kTactile}});
    address.order = link.choice<SonicsurfaceOrder>(
        "order", "fpga", {{"fpga", SonicsurfaceOrder::kFpga}, {"natural", SonicsurfaceOrder::kNatural}});
  } else if (link.scheme == "autd3-udp") {
    address.kind = LinkAddress::Kind::kAutd3Udp;
    if (link.place.find(':') == std::string::npos) {
      address.host = link.place;
    } else {
      read_host(link, link.place, address);
    }
  } else {
    link.refuse(fmt::format("must be {}", kForms));
  }
  if (!link.options.empty()) {
    link.refuse(fmt::format("it has no option '{}'", link.options.begin()->first));
  }
  return address;
}

}  // namespace touchfield

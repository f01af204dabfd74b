#pragma once

#include <optional>
#include <string>

namespace touchfield {

/// Where this machine listens for datagrams by UDP.
struct ListenAddress {
  std::string host = "127.0.0.1";  // an IP address; 0.0.0.0 and :: are all that this machine has
  int port = 0;

  /// "127.0.0.1:9000", "[::1]:9000"
  std::string text() const;
  /// Whether programs of this machine alone reach it.
  bool is_loopback() const { return host == "::1" || host.starts_with("127."); }
};

/// Of "PORT", "ADDRESS:PORT" or "[ADDRESS]:PORT", the last one for IPv6; nothing if the text is none of them.
std::optional<ListenAddress> listen_address(const std::string& text);

}  // namespace touchfield

#include "sim/scene/listen_address.h"

#include <array>
#include <memory>
#include <netdb.h>
#include <sys/socket.h>

#include <fmt/format.h>

#include "sim/core/text.h"

namespace touchfield {

std::string ListenAddress::text() const {
  return host.find(':') == std::string::npos ? fmt::format("{}:{}", host, port) : fmt::format("[{}]:{}", host, port);
}

std::optional<ListenAddress> listen_address(const std::string& text) {
  ListenAddress address;
  const std::size_t colon = text.rfind(':');
  const auto port = number_of<int>(colon == std::string::npos ? text : text.substr(colon + 1));
  if (!port || *port < 1 || *port > 65535) {
    return {};
  }
  address.port = *port;
  if (colon == std::string::npos) {
    return address;
  }
  std::string host = text.substr(0, colon);
  const bool bracketed = host.starts_with('[') && host.ends_with(']');
  host = bracketed ? host.substr(1, host.size() - 2) : host;
  addrinfo wanted{};
  wanted.ai_flags = AI_NUMERICHOST;
  wanted.ai_family = bracketed ? AF_INET6 : AF_INET;
  addrinfo* found = nullptr;
  if (host.empty() || ::getaddrinfo(host.c_str(), nullptr, &wanted, &found) != 0) {
    return {};
  }
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, ::freeaddrinfo);
  std::array<char, NI_MAXHOST> name{};
  if (::getnameinfo(found->ai_addr, found->ai_addrlen, name.data(), name.size(), nullptr, 0, NI_NUMERICHOST) != 0) {
    return {};
  }
  address.host = name.data();
  return address;
}

}  // namespace touchfield

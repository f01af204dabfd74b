#include "hardware/links/make_link.h"

#include <stdexcept>

#include "hardware/links/autd3_udp_link.h"
#include "hardware/links/dry_run_link.h"
#include "hardware/links/sonicsurface_link.h"
#include "sim/core/errors.h"

namespace touchfield {

std::unique_ptr<ArrayLink> make_link(const LinkSettings& settings) {
  const LinkAddress address = parse_link_address(settings.address);
  const bool has_array = settings.array.positions.cols() > 0;
  switch (address.kind) {
    case LinkAddress::Kind::kDryRun:
      if (!has_array) {
        throw InputError("dry-run: it needs the array of a run; add --run RUN");
      }
      return std::make_unique<DryRunLink>(settings.array, address.levels,
                                          DryRunFiles{address.path, settings.frames, settings.replace});
    case LinkAddress::Kind::kSonicsurface:
      return std::make_unique<SonicsurfaceLink>(address.path, address.firmware, address.order);
    case LinkAddress::Kind::kAutd3Udp:
      return std::make_unique<Autd3UdpLink>(
          address.host, address.port,
          has_array ? autd3_placements(settings.array) : std::vector<UnitPlacement>{UnitPlacement{}});
  }
  throw std::logic_error("unknown link");
}

}  // namespace touchfield

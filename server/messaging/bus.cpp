#include "layfigure/messaging/bus.h"

#include <charconv>
#include <cstdlib>
#include <utility>

#include "broker_link.h"
#include "lcm_link.h"

namespace layfigure::messaging {
namespace {

Routes make_routes(const std::string& prefix, Bus::Handlers handlers) {
  Routes routes;
  for (auto& [channel, handler] : handlers) routes.push_back({channel_name(prefix, channel), std::move(handler)});
  return routes;
}

std::unique_ptr<Link> make_link(const BusSettings& settings, Bus::Handlers handlers) {
  Routes routes = make_routes(settings.channel_prefix, std::move(handlers));
  if (settings.broker != nullptr) return std::make_unique<BrokerLink>(*settings.broker, std::move(routes));
  return std::make_unique<LcmLink>(settings.url, std::move(routes));
}

}  // namespace

std::string default_bus_url() {
  const char* url = std::getenv("LCM_DEFAULT_URL");
  return url != nullptr && *url != '\0' ? url : "udpm://239.255.76.67:7667?ttl=0";
}

int multicast_ttl(std::string_view url) {
  constexpr std::string_view kOption = "ttl=";
  if (!url.starts_with("udpm:")) return 0;
  int ttl = 0;
  for (std::size_t at = url.find('?'); at != std::string_view::npos; at = url.find('&', at + 1)) {
    const std::string_view option = url.substr(at + 1);
    if (!option.starts_with(kOption)) continue;
    std::from_chars(option.data() + kOption.size(), option.data() + option.size(), ttl);
  }
  return ttl;
}

Bus::Bus(const BusSettings& settings, Handlers handlers)
    : prefix_(settings.channel_prefix), link_(make_link(settings, std::move(handlers))) {}

Bus::~Bus() = default;

void Bus::publish_bytes(Channel channel, Bytes bytes) {
  link_->publish(channel_name(prefix_, channel), std::move(bytes));
}

std::int64_t Bus::dropped_messages() const { return link_->dropped_messages(); }

}  // namespace layfigure::messaging

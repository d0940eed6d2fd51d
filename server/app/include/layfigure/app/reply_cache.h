#pragma once

#include <cstddef>
#include <cstdint>
#include <layfigure/reply_t.hpp>
#include <list>
#include <map>
#include <string>

namespace layfigure::app {

/// The last replies to each client, so that a repeated command is answered again and not carried out again.
class ReplyCache {
 public:
  static constexpr std::size_t kRepliesPerClient = 64;
  static constexpr std::size_t kClients = 64;  ///< beyond it the client that was silent longest is forgotten

  /// The reply to that command, null if it is not remembered. Valid until the next store().
  [[nodiscard]] const reply_t* find(const std::string& client_id, std::int64_t sequence) const;
  /// True if the command is so old that it may have been carried out without being remembered.
  [[nodiscard]] bool is_too_old(const std::string& client_id, std::int64_t sequence) const;
  void store(const reply_t& reply);

 private:
  struct Client {
    std::string id;
    std::map<std::int64_t, reply_t> replies;  // by sequence
    std::int64_t forgotten{0};                // the highest sequence that is no longer remembered
  };

  [[nodiscard]] const Client* find_client(const std::string& client_id) const;
  Client& touch(const std::string& client_id);

  std::list<Client> clients_;  // the one heard of last comes first
};

}  // namespace layfigure::app

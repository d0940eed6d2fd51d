#include "layfigure/app/reply_cache.h"

#include <algorithm>

namespace layfigure::app {

const ReplyCache::Client* ReplyCache::find_client(const std::string& client_id) const {
  const auto found = std::ranges::find(clients_, client_id, &Client::id);
  return found == clients_.end() ? nullptr : &*found;
}

const reply_t* ReplyCache::find(const std::string& client_id, std::int64_t sequence) const {
  const Client* client = find_client(client_id);
  if (client == nullptr) return nullptr;
  const auto reply = client->replies.find(sequence);
  return reply == client->replies.end() ? nullptr : &reply->second;
}

bool ReplyCache::is_too_old(const std::string& client_id, std::int64_t sequence) const {
  const Client* client = find_client(client_id);
  return client != nullptr && sequence <= client->forgotten;
}

void ReplyCache::store(const reply_t& reply) {
  Client& client = touch(reply.client_id);
  client.replies.insert_or_assign(reply.sequence, reply);
  if (client.replies.size() <= kRepliesPerClient) return;
  const auto oldest = client.replies.begin();
  client.forgotten = oldest->first;
  client.replies.erase(oldest);
}

ReplyCache::Client& ReplyCache::touch(const std::string& client_id) {
  const auto found = std::ranges::find(clients_, client_id, &Client::id);
  if (found != clients_.end()) {
    clients_.splice(clients_.begin(), clients_, found);
  } else {
    clients_.push_front({client_id, {}, 0});
    if (clients_.size() > kClients) clients_.pop_back();
  }
  return clients_.front();
}

}  // namespace layfigure::app

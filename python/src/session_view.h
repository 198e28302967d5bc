// The page on a session that Python leads: a server in a thread of its own, which never needs Python's lock.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "kerf/base/result.h"
#include "kerf/record/recording.h"
#include "kerf/session/session.h"

namespace kerf {
class LedSession;
}

namespace kerf::python {

/// How to serve it.
struct ViewRequest {
  int port = 0;              ///< 0: any free one
  std::string token;         ///< that pages must know
  std::uint64_t number = 1;  ///< random: a page that knows another one gets the whole body
  std::string embedders;     ///< ServerOptions::embedders
};

class SessionView {
 public:
  /// Opens the port; the caller is in the session. Errors: no page was built in, the port is in use.
  static Result<std::shared_ptr<SessionView>> create(Session& session, const SceneSource& source,
                                                     const ViewRequest& request);
  SessionView(const SessionView&) = delete;
  SessionView& operator=(const SessionView&) = delete;
  ~SessionView();

  /// Begins to serve. Bad luck: no thread can be had.
  Status start();
  /// Who is in the session: whoever uses it enters this first.
  [[nodiscard]] const std::shared_ptr<LedSession>& led() const;
  [[nodiscard]] const std::string& address() const;
  [[nodiscard]] int port() const;
  /// One more page that brings it is led to the token.
  void expect(const std::string& ticket);
  /// Ends it; nobody looks at the session any more. From any thread, again and again.
  void close();
  /// In the child of a fork, where the thread is not: gives the port back. The view must live on, unused.
  void abandon();

 private:
  struct Impl;
  explicit SessionView(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace kerf::python

// The page on a session.
#include <memory>
#include <string>
#include <utility>

#include "errors.h"
#include "live_session.h"
#include "live_session_use.h"
#include "python_lock.h"

namespace kerf::python {

std::shared_ptr<SessionView> LiveSession::view() {
  const std::scoped_lock lock(view_mutex_);
  return view_;
}

void LiveSession::forget_view(const std::shared_ptr<SessionView>& view) {
  const std::scoped_lock lock(view_mutex_);
  if (view_ != view) return;
  view_.reset();
  watched_in_vain_ = true;
}

void LiveSession::stop_watching_where_due() {
  if (watched_in_vain_.exchange(false) && session_) session_->watch_changes(false);
}

void LiveSession::open_view(const ViewRequest& request) {
  if (view()) close_view();
  Use session(*this);
  stop_watching_where_due();
  auto made = value_of(unlocked([&] { return SessionView::create(*session, begin_.source, request); }));
  session.enter(made->led());
  if (const Status started = made->start(); !started) {
    watched_in_vain_ = true;
    throw Failure(started.error());
  }
  const std::scoped_lock lock(view_mutex_);
  view_ = std::move(made);
}

void LiveSession::close_view() {
  const auto watched = view();
  if (!watched) return;
  unlocked([&] { watched->close(); });
  forget_view(watched);
  if (busy_.exchange(true)) return;  // whoever is in it stops the watching
  stop_watching_where_due();
  busy_ = false;
}

std::string LiveSession::view_address() {
  const auto watched = view();
  return watched ? watched->address() : std::string();
}

int LiveSession::view_port() {
  const auto watched = view();
  return watched ? watched->port() : 0;
}

void LiveSession::expect_page(const std::string& ticket) {
  if (const auto watched = view()) watched->expect(ticket);
}

void LiveSession::abandon_view() {
  if (!view_) return;
  view_->abandon();
  // Its thread is the parent's: what it holds is never given back here.
  new std::shared_ptr<SessionView>(std::move(view_));
  view_.reset();
}

}  // namespace kerf::python

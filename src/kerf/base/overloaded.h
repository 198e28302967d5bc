/// One visitor of a variant out of several lambdas.
#pragma once

namespace kerf {

template <class... Fs>
struct Overloaded : Fs... {
  using Fs::operator()...;
};
template <class... Fs>
Overloaded(Fs...) -> Overloaded<Fs...>;

}  // namespace kerf

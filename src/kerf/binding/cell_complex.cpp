#include "kerf/binding/cell_complex.h"

namespace kerf {

CellComplex::CellComplex() = default;
CellComplex::CellComplex(const CellComplex&) = default;
CellComplex::CellComplex(CellComplex&&) noexcept = default;
CellComplex& CellComplex::operator=(const CellComplex&) = default;
CellComplex& CellComplex::operator=(CellComplex&&) noexcept = default;
CellComplex::~CellComplex() = default;

template void journal_mark(CellComplex&, JournalMark&);
template void journal_rollback(CellComplex&, const JournalMark&);

}  // namespace kerf

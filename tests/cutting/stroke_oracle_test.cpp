// Strokes nobody rehearsed, each trial on a body made whole again: what the blade parted comes apart, and nothing else.
#include <chrono>
#include <cstdlib>
#include <initializer_list>
#include <numbers>

#include "cutting/stroke_sets.h"

namespace kerf::stroke_oracle_test {
namespace {

using namespace testing_support;

constexpr double kPi = std::numbers::pi;

/// Trials on one body; counts what goes wrong.
struct Trials {
  explicit Trials(StrokeBody& b, int may_be_wrong = 0) : body(b), allowed(may_be_wrong) {}
  Trials(const Trials&) = delete;
  Trials& operator=(const Trials&) = delete;

  void expect_pieces(const std::vector<Stroke>& strokes, int pieces, int poses = 40) {
    body.make_whole();
    for (const Stroke& s : strokes) body.cut(s, poses);
    const Status valid = validate_complex(body.body, body.start);
    EXPECT_TRUE(valid.ok()) << (valid.ok() ? "" : valid.error().message) << text_of(strokes);
    ++count;
    const int made = body.pieces();
    if (made == pieces) return;
    if (wrong++ == 0)
      first_wrong = std::to_string(made) + " pieces for " + std::to_string(pieces) + ":" + text_of(strokes);
  }
  ~Trials() { EXPECT_LE(wrong, allowed) << "of " << count << "; first " << first_wrong; }

  StrokeBody& body;
  int allowed = 0, wrong = 0, count = 0;
  std::string first_wrong;
};

Stroke line(Vec2 through, double angle, double reach) {
  const Vec2 along{reach * std::cos(angle), reach * std::sin(angle)};
  return {through - along, through + along};
}
/// A pair of lines at 30 to 150 degrees.
std::vector<Stroke> pair_through(Vec2 p, double reach, Random& random) {
  const double a = random.uniform(0, kPi), b = a + random.uniform(30, 150) * kPi / 180;
  return {line(p, a, reach), line(p, b, reach)};
}
/// `off`: metres beside an inner vertex of the collision mesh, in any direction.
void cross_at_vertices(StrokeBody& b, Random& random, int times, double off) {
  b.make_whole();
  std::vector<Vec3> inner;
  const CollisionMesh& m = b.body.collision;
  for (const CollisionVertex v : ids<CollisionVertex>(m.vertex_count()))
    if (!m.on_border(v)) inner.push_back(m.rest[v]);
  Trials trials(b);
  for (int i = 0; i < times; ++i) {
    const Vec3 v = inner[static_cast<std::size_t>(random.index(static_cast<int>(inner.size())))];
    const double angle = random.uniform(0, 2 * kPi);
    trials.expect_pieces(pair_through({v.x + off * std::cos(angle), v.y + off * std::sin(angle)}, 1.5, random), 4);
  }
}
void cross_anywhere(StrokeBody& b, Random& random, int times, double size) {
  Trials trials(b);
  for (int i = 0; i < times; ++i) {
    const Vec2 p{random.uniform(-0.25, 0.25) * size, random.uniform(-0.2, 0.2) * size};
    trials.expect_pieces(pair_through(p, 1.2 * size, random), 4);
  }
}

class StrokeOracle : public ::testing::Test {
 protected:
  StrokeBody sheet{"closed-sheet", 2500};  ///< 1 m wide, 104 collision triangles with edges of 0.156 m
  [[nodiscard]] double edge() const { return sheet.body.mean_root_edge; }
};

// The second path reaches the first slit at a vertex; the slit's other lip has one at the same place.
TEST_F(StrokeOracle, TwoCutsNearTheCorner) {
  const double at = -0.45238095238095238;
  Trials(sheet).expect_pieces({{{at, -0.6}, {at, 0.6}}, {{-0.6, at}, {0.6, at}}}, 4);
}
TEST_F(StrokeOracle, CrossingsMakeFourPieces) {
  Random random(1);
  cross_anywhere(sheet, random, 200, 1);
}
TEST_F(StrokeOracle, CrossingsAtAVertex) {
  Random random(2);
  cross_at_vertices(sheet, random, 100, 0);
}
TEST_F(StrokeOracle, CrossingsNearAVertex) {
  Random random(3);
  cross_at_vertices(sheet, random, 100, 0.02 * edge());
}
TEST(StrokeOracleSteak, CrossingsMakeFourPieces) {
  StrokeBody steak("steak");
  Random random(4);
  cross_anywhere(steak, random, 60, 0.2);
}
TEST_F(StrokeOracle, CrossingsOfATiltedBlade) {
  Random random(5);
  for (const double tilt : {0.02, 0.05, 0.1, 0.15}) {  // m over 0.7 m: up to 23 degrees
    sheet.tilt = tilt;
    cross_anywhere(sheet, random, 25, 1);
    cross_at_vertices(sheet, random, 25, 0);
  }
}
TEST_F(StrokeOracle, CrossingsInAWavyBody) {
  sheet.deform = [](Vec3 p) {
    return Vec3{p.x + 0.03 * std::sin(7 * p.y), p.y, p.z + 0.05 * std::sin(9 * p.x) * std::cos(8 * p.y)};
  };
  Random random(6);
  cross_anywhere(sheet, random, 50, 1);
  cross_at_vertices(sheet, random, 50, 0);
}

/// In from one side, turned by `degrees` inside, and out again.
void turn(StrokeBody& b, Random& random, int times, double least, double most, bool two_strokes) {
  Trials trials(b);
  for (int i = 0; i < times; ++i) {
    const double half = 0.5 * kPi / 180 * (180 - random.uniform(least, most)), lean = random.uniform(-0.25, 0.25);
    const Vec2 corner{random.uniform(-0.25, -0.15), random.uniform(-0.1, 0.1)};
    const Vec2 in = corner - 1.5 * Vec2{std::cos(half + lean), std::sin(half + lean)};
    const Vec2 out = corner - 1.5 * Vec2{std::cos(half - lean), -std::sin(half - lean)};
    trials.expect_pieces(
        two_strokes ? std::vector<Stroke>{{in, corner}, {corner, out}} : std::vector<Stroke>{{in, corner, out}}, 2);
  }
}
TEST_F(StrokeOracle, TurnsWithinAStroke) {
  Trials(sheet).expect_pieces({{{-0.65, 0.02}, {-0.35, 0.02}, {-1.38923048, 0.62}}}, 2, 20);
  Random random(7);
  turn(sheet, random, 50, 70, 130, false);
  turn(sheet, random, 100, 130, 170, false);
}
TEST_F(StrokeOracle, TurnsBetweenTwoStrokes) {
  Random random(8);
  turn(sheet, random, 50, 70, 130, true);
  turn(sheet, random, 100, 130, 170, true);
}

TEST_F(StrokeOracle, DiceOfThreeToTwelveLines) {
  Trials trials(sheet);
  for (const int lines : {3, 5, 8, 12})
    for (const double off : {0.0, 0.013, -0.021, 0.0037}) {
      std::vector<Stroke> strokes;
      for (const bool across : {false, true})
        for (int k = 1; k <= lines; ++k) {
          const double at = -0.5 + static_cast<double>(k) / (lines + 1) + off;
          strokes.push_back(across ? Stroke{{-0.6, at}, {0.6, at}} : Stroke{{at, -0.6}, {at, 0.6}});
        }
      trials.expect_pieces(strokes, (lines + 1) * (lines + 1));
    }
}

// A second stroke follows the slit of a first one and goes on from its end: two halves, however small the poses.
TEST_F(StrokeOracle, AStrokeGoesOnFromTheEndOfASlit) {
  for (const int poses : {3, 200}) {
    Trials trials(sheet);
    for (int k = 0; k < 12; ++k)
      trials.expect_pieces({{{0.05, -0.85}, {0.05, -0.2 + 0.0375 * k}}, {{0.05, -0.85}, {0.05, 0.85}}}, 2, poses);
  }
}

// A closed stroke frees what it goes around: its end is the place where it began.
TEST_F(StrokeOracle, NestedHexagons) {
  Random random(11);
  Trials trials(sheet);
  constexpr int kLoops = 5;
  for (int i = 0; i < 30; ++i) {
    const double largest = 0.46 - random.uniform(0, 0.01), turned = i < 2 ? 0 : random.uniform();
    std::vector<Stroke> strokes;
    for (int loop = 0; loop < kLoops; ++loop) {
      Stroke s;
      for (int k = 0; k <= 6; ++k) {
        const double angle = kPi / 3 * k + 0.3 * loop + turned, radius = largest - 0.08 * loop;
        s.push_back({radius * std::cos(angle), radius * std::sin(angle)});
      }
      strokes.push_back(s);
    }
    if (i % 2 == 1) std::reverse(strokes.begin(), strokes.end());
    trials.expect_pieces(strokes, kLoops + 1, i < 2 ? 4 : 40);
  }
}

// A stroke that comes within a minimum feature of the rim, at a vertex of it or between two, and turns: a lens comes out.
TEST_F(StrokeOracle, TurnsAtTheRim) {
  for (const double before : {-0.03, -1e-5, 1e-9, 1e-3, 0.01, 0.02})  // edges before the rim
    for (const int poses : {1, 8, 200}) {
      Trials trials(sheet);
      for (const double x : {-1.0 / 3, -0.25, 1e-7, 0.09, 1.0 / 6})  // every other a vertex of the rim
        trials.expect_pieces({{{x - 0.17, -0.6}, {x, 0.5 - before * edge()}, {x + 0.21, -0.6}}}, 3, poses);
    }
}

// Where the path leaves the rim it crosses an edge, and has a slit of its own from there on: the join to the rim was forgotten.
TEST_F(StrokeOracle, ATurnOnTheRimBesideAnEdgeIsJoinedToIt) {
  Trials trials(sheet);
  const Stroke stroke{{-0.20483093993673268, 0.022828930626305977},
                      {0.49999999802904982, -0.33333333333333331},
                      {-0.16061656387886095, -0.5},
                      {5.1916656318229364e-09, -0.33333333333333331}};
  for (const int poses : {1, 40, 200, 400}) trials.expect_pieces({stroke}, 2, poses);
}

// A stroke crosses another one where a third has ended, 0.03 edges before the crossing: only a crumb lay between the tip of its own slit and the lip.
TEST_F(StrokeOracle, AStrandBesideATipThatThePathPassesIsParted) {
  Trials trials(sheet);
  const Stroke ended{{-0.23966087440213671, -0.083333333844259561}, {0.083333333333333329, -0.083334265703975258}},
      across{{-0.083231331721287397, -0.24174663254440978}, {0.49999943735358882, 0.33333936809781328}},
      turning{{-0.00033682283603099668, 0.1666666748761183},
              {0.25000208954459707, -0.24999999123228775},
              {-0.25000000205688272, 0.25999645795963428}};
  for (const int poses : {1, 3, 30, 40, 80}) trials.expect_pieces({ended, across, turning}, 2, poses);
}

// The path of the fourth stroke comes to where three have met. Its last edge holds a crumb between the tip of the third and a lip; up to that tip it parts
// the body.
TEST_F(StrokeOracle, AShortPathIsCutUpToWhereItHoldsACrumb) {
  StrokeBody steak("steak");
  Trials trials(steak);
  const auto even = [](Vec2 a, Vec2 b, int parts) {
    Stroke s;
    for (int i = 0; i <= parts; ++i) s.push_back(lerp(a, b, static_cast<double>(i) / parts));
    return s;
  };
  trials.expect_pieces(
      {even({-0.02685187768034819, 0.01099810977033455}, {-0.019648514796235153, 0.012898305731195313}, 2),
       even({-0.02428660752279671, 0.007609911680872786}, {-0.020503604848752327, 0.014027705094349224}, 2),
       even({-0.022141356971072466, 0.007426436246429316}, {-0.02151226474033697, 0.011969000332384586}, 5),
       even({-0.015133911346867542, -0.010950345245878082}, {-0.04039568802845105, 0.08254406270155472}, 26),
       even({0.08704720411423508, 0.05206144138668334}, {-0.018832338965644027, -0.00931167242344421}, 15)},
      2, 1);
}

// A turn is cut to its corner, to within a minimum feature, however many poses the stroke has: the way back passes over the way there before it is seen to turn.
TEST_F(StrokeOracle, AnAcuteTurnIsCutToItsCorner) {
  const double feature = sheet.options.minimum_feature * edge(), side = 3 * edge();
  const CollisionMesh& mesh = sheet.body.collision;
  for (const int poses : {20, 200, 1000})
    for (const double degrees : {5.0, 11.0, 30.0, 60.0})
      for (int k = 0; k < 12; ++k) {
        const double way = 0.7 * k, back = way + degrees * kPi / 180;
        const Vec2 corner{0.1 + 0.18 * edge() * std::cos(2.4 * k), 0.07 + 0.18 * edge() * std::sin(2.4 * k)};
        sheet.make_whole();
        sheet.cut({corner + side * Vec2{std::cos(way), std::sin(way)}, corner,
                   corner + side * Vec2{std::cos(back), std::sin(back)}},
                  poses);
        double nearest = HUGE_VAL;
        for (const CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count()))
          if (mesh.on_border(v))
            nearest = std::min(nearest, std::hypot(mesh.rest[v].x - corner.x, mesh.rest[v].y - corner.y));
        EXPECT_LT(nearest, feature) << poses << " poses, " << degrees << " degrees, " << k;
      }
}

// So what passes the corner beside it parts what lies between.
TEST_F(StrokeOracle, AStrokePastTheCornerOfATurn) {
  Trials trials(sheet);
  for (const int poses : {40, 100, 150, 199, 200, 201, 300, 400})
    trials.expect_pieces({{{0.63286306239221657, 0.074415241917905856},
                           {0.30637631811125687, -0.14801021012988613},
                           {0.66990131864586533, 0.0066385851973268795}},
                          {{0.23279696622063156, 0.26224265278771647},
                           {0.32226130561597799, -0.23464652533210512},
                           {0.62694925422180803, 0.16793014727872624}}},
                         5, poses);
}

// The path turns on the rim, at a vertex, into the other side of its own slit.
TEST_F(StrokeOracle, ATurnOnTheRimBackOverItsOwnSlit) {
  Trials(sheet).expect_pieces({{{-0.25, -0.25}, {0.5, -0.35}, {0, -0.5}, {0.35, 0.15}}}, 3, 1);
}

// There and back along one line, over the rim beside a vertex of it and inside: the way back cuts nothing. One way in a hundred had parted a crumb: the blade stood in
// its slit near the rim and was joined to it, or the way in had been rounded farther than the way back could see.
TEST_F(StrokeOracle, ThereAndBackAlongOneLine) {
  Random random(1);
  Trials trials(sheet);
  const double h = edge();
  const auto inside = [](Vec2 p) { return Vec2{std::clamp(p.x, -0.45, 0.45), std::clamp(p.y, -0.45, 0.45)}; };
  for (int i = 0; i < 500; ++i) {
    const double a = random.uniform(0.07, 0.93) * kPi, b = random.uniform(0, 2 * kPi);
    const Vec2 way{std::cos(a), std::sin(a)};
    const Vec2 rim{(random.index(3) - 1) / 6.0 + random.uniform(-0.15, 0.15) * h, -0.5};
    const Vec2 out = rim - 0.5 * h * way, in = rim + random.uniform(0.3, 2) * h * way;
    const Vec2 p{random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4)};
    const Vec2 q = inside(p + random.uniform(0.3, 2.5) * h * Vec2{std::cos(b), std::sin(b)});
    const double part = random.uniform(0.05, 0.9);
    for (const int poses : {1, 7}) {
      trials.expect_pieces({{out, in, lerp(out, in, part)}}, 1, poses);
      trials.expect_pieces({{out, in, out - 0.1 * (in - out), in}}, 1, poses);
      trials.expect_pieces({{p, q, lerp(p, q, part)}}, 1, poses);
    }
  }
}

// Where a chord ends on the line of an edge beyond it, rounding put what is left of it on its right.
TEST_F(StrokeOracle, ARoomOfNothingBesideAChord) {
  const Stroke there = {{-0.2892037024814242, 0.2964606139793199},
                        {-0.23760223750398118, 0.47852167079999985},
                        {0.4885110435261891, 0.4965490383257539},
                        {-0.5289409026165106, -0.09238128208522345},
                        {0.49710490475884705, -0.4984703817908986}};
  Stroke back = there;
  back.insert(back.end(), there.rbegin() + 1, there.rend());
  Trials trials(sheet);
  trials.expect_pieces({there}, 3, 7);
  trials.expect_pieces({back}, 3, 7);
  trials.expect_pieces({there, there}, 3, 7);
}

// The way back runs along its slit and past the tip, where the blade began. Between lip and tip lies a crumb, which holds; beyond it the cut goes on.
TEST_F(StrokeOracle, BackPastTheTipOfItsOwnSlit) {
  Trials(sheet).expect_pieces({{{0.4309164445631263, -0.6483710694926945},
                                {0.11972278408890413, 0.06262347587208039},
                                {0.026743424275147643, 0.3349784358278184},
                                {-0.3528897126824892, 0.6277166265790367},
                                {0.158514096454752, -0.323369425116096},
                                {0.5816360473461187, 0.3672713534996547}},
                               {{0.0005305788321989802, 0.15124072103788777},
                                {0.12342899829224019, 0.3033056817849711},
                                {0.5095462834003551, 0.2149239469747699},
                                {0.5819097608978009, -0.04214074407720203},
                                {0.08369389927271309, -0.4251571208646646}},
                               {{0.054509974819210494, 0.3786789809145946},
                                {0.2999046061335567, 0.5422445306695783},
                                {-0.5047672593417831, -0.008333346018196242}}},
                              10, 3);
}

// The way back from an acute turn runs along a wedge between two lips, near to both of them. It cut the tip off the wedge, or a crumb beside a lip.
// The blade comes back on what it has cut to the last bit, and rounding says on which side of a lip it is: random ones fail twice in a hundred times, as with a plane through the blade.
TEST_F(StrokeOracle, BackFromAnAcuteTurn) {
  Trials trials(sheet, 2);
  struct Path {
    int pieces, poses;
    Stroke there;
  };
  for (const auto& [pieces, poses, there] : std::initializer_list<Path>{
           {2,
            3,
            {{0.612303579662835, -0.07233301782749635},
             {-0.07245588892573451, 0.3417627094852893},
             {0.49055329279342497, 0.02998733380627583},
             {-0.27883871028394336, 0.38219558736099735}}},
           {2,
            3,
            {{-0.3751095544486167, -0.19880535456789067},
             {0.140140984577534, 0.1958408453363789},
             {0.08464917947337314, -0.21668025182543416},
             {0.045113787257503146, 0.44612386413276306},
             {-0.18294242595734994, 0.10539188264222299}}},
           {2,
            1,
            {{0.5803596611553526, -0.536326498584},
             {-0.42210713344241735, -0.4963047341884469},
             {0.3630912408599928, -0.09440065791635666},
             {-0.5430343281155879, -0.1495382842024876}}},
           {2,
            1,
            {{0.10941458480866917, -0.3092091906408989},
             {-0.013342879659958395, -0.21059872935963309},
             {0.15834521266857127, 0.3205079727346586},
             {0.30972771064713855, -0.32763183606800395},
             {-0.4198483638551375, -0.2571221489663182}}},
           {1,
            40,
            {{-0.30951828491618916, -0.26343329283177713},
             {0.3952505774059536, -0.17073046241380768},
             {0.18844924511402839, -0.1559309106853075}}},
           {1,
            1,
            {{-0.1378811111527275, -0.07246965131383737},
             {0.4650759159785387, 0.4669885798109661},
             {-0.23816888456841545, -0.23091154146710005},
             {0.3789517899171595, -0.38986646368814987}}},
           {1,
            3,
            {{-0.047105008926800696, 0.13558690305641985},
             {0.25365192342992826, 0.2770842815532988},
             {-0.23271558037750645, -0.11446024598565163},
             {-0.3561343905040986, -0.3591643981074487}}},
           {4,
            3,
            {{0.5561178402752168, -0.27779787899620534},
             {-0.5977910424586346, 0.3238104899623788},
             {0.03971289421432078, -0.37156232954180113},
             {-0.5924988454987047, 0.41385728583022396}}},
           {1,
            7,
            {{-0.39234380252260026, 0.42251628181776313},
             {-0.25486205730500416, 0.47480652380944666},
             {-0.37114493599053483, 0.490330119496578},
             {-0.028348149490307395, 0.43971527426555757}}},
           {2,
            7,
            {{-0.48289601887760847, 0.23819320192822735},
             {0.002940587343117085, -0.2598570051332561},
             {0.3148723775693002, 0.5587220038527624},
             {0.478440431795235, 0.00020332956667690194},
             {0.5406781843928598, -0.6238240909696445}}},
           {1,
            3,
            {{0.07388822668186457, 0.04001288902420741},
             {0.1281558438545103, -0.48379830275092717},
             {-0.3296824978310842, -0.056587021171072616},
             {0.025705514511497607, -0.23053625806688122}}},
       }) {
    Stroke back = there;
    back.insert(back.end(), there.rbegin() + 1, there.rend());
    trials.expect_pieces({there}, pieces, poses);
    trials.expect_pieces({back}, pieces, poses);
    trials.expect_pieces({there, there}, pieces, poses);
  }
}

// Repeated. Behind a turn, within half an edge, lies the rim: the second time it was looked for there, as if material had moved, and the body fell apart.
TEST_F(StrokeOracle, BehindATurnNothingIsCut) {
  Trials trials(sheet);
  {
    const Stroke path = {{0.42206156486506863, 0.16958954569341578},
                         {0.34437605985829134, -0.4754252668732843},
                         {-0.6301955354025586, 0.6177634718554886},
                         {-0.4199445356518337, 0.5384432221750303}};
    trials.expect_pieces({path, path}, 1, 7);
  }
  {
    const Stroke path = {{-0.12207924342502896, -0.011348740021026704},
                         {0.44762309675437184, 0.48517284915212844},
                         {0.2338321453082296, 0.0973119361444188},
                         {0.1724203657553548, -0.1065287653485355},
                         {-0.6346508202047308, 0.22711848325350759}};
    trials.expect_pieces({path, path}, 2, 40);
  }
}

// A sheet that hangs nearly along the blade: a millimetre behind the edge is six of the sheet. The cut ends where the blade turned, while the sheet keeps still
// and while it trembles to and fro in its plane by a hundredth of an edge.
TEST_F(StrokeOracle, ASteepSheetIsCutNoFartherThanTheTurn) {
  StrokeBody steep("closed-sheet", 2500);
  steep.deform = [](Vec3 p) { return Vec3{p.x, 0.17 * p.y, 0.985 * p.y}; };
  steep.reach = 2;
  steep.stroke.through = true;
  const auto there = [](double x, double y) { return Vec2{x, 0.17 * y}; };
  const Vec3 ways[] = {{1, 0, 0}, {0, 0.17, 0.985}};
  for (const double trembles : {0.0, 0.0001, 0.01})
    for (const Vec3 way : ways) {
      steep.trembling = trembles * steep.body.mean_root_edge * way;
      Random random(1);
      for (const int poses : {1, 3, 40}) {
        Trials trials(steep);
        for (int i = 0; i < 10; ++i) {
          const double x = random.uniform(-0.3, 0.3), far = random.uniform(0.05, 0.12),
                       wide = random.uniform(0.05, 0.15);
          trials.expect_pieces(
              {{there(-0.7, 0), there(0.7, 0)}, {there(x - wide, -0.7), there(x, -far), there(x + wide, -0.7)}}, 3,
              poses);
        }
      }
    }
}

// A loop begins inside, beside the rim, and comes back over the rim: its end is its beginning, however near the rim runs beside the way there. One in twelve
// stayed open.
TEST_F(StrokeOracle, LoopsThatCloseBesideTheRim) {
  Trials trials(sheet);
  for (const Stroke& loop :
       {Stroke{{0.0321, -0.4845}, {-0.117, -0.241}, {0.282, -0.1}, {0.144, -0.599}, {0.0321, -0.4845}},
        Stroke{{0.0623, -0.4907}, {-0.036, -0.281}, {0.312, -0.1}, {0.178, -0.538}, {0.0623, -0.4907}},
        Stroke{{-0.1137, -0.4938}, {-0.257, -0.292}, {0.136, -0.1}, {0.018, -0.569}, {-0.1137, -0.4938}},
        Stroke{{-0.0968, -0.4845}, {-0.179, -0.377}, {0.153, -0.1}, {0.016, -0.582}, {-0.0968, -0.4845}},
        Stroke{{-0.1014, -0.4891}, {-0.1767, -0.294}, {0.0801, -0.1504}, {0.0267, -0.5768}, {-0.1014, -0.4891}}})
    for (const int poses : {1, 3, 20}) {
      trials.expect_pieces({loop}, 2, poses);
      trials.expect_pieces({Stroke(loop.rbegin(), loop.rend())}, 2, poses);
    }
}

// A triangle begins and ends at a corner just beyond an earlier cut: the lip runs beside both of its sides, and the corner comes off. One in seven stayed open;
// and one in fifteen with the blade's base below.
TEST_F(StrokeOracle, LoopsThatCloseBeyondACut) {
  const double edge = sheet.body.mean_root_edge;
  Trials trials(sheet);
  Random random(3);
  for (int i = 0; i < 60; ++i) {
    const double x = random.uniform(-0.3, 0.3), y = random.uniform(-0.2, 0.2), tip = random.uniform(0.11, 0.2) * edge,
                 deep = random.uniform(0.15, 0.25), left = random.uniform(-0.2, -0.1),
                 right = random.uniform(0.02, 0.1);
    const Vec2 corner{x, y + tip};
    for (const bool other_way_up : {false, true}) {
      sheet.reach = other_way_up ? -std::fabs(sheet.reach) : std::fabs(sheet.reach);
      for (const int poses : {1, 10})
        trials.expect_pieces({{{-0.7, y}, {0.7, y}}, {corner, {x + left, y - deep}, {x + right, y - deep}, corner}}, 4,
                             poses);
    }
  }
}

// Each of these left a bridge: a line past a corner half a minimum feature away; a path past its own corner; a loop that begins near a vertex of the mesh; a
// path that ends at the tip of a slit and goes on; a line that passes a corner between two edges; a loop that begins a minimum feature and a half from a vertex; a turn on the rim, out of a corner; a
// loop whose piece at a corner is too short to have a direction.
TEST_F(StrokeOracle, CornersAndTipsThatAPathPasses) {
  Trials trials(sheet);
  trials.expect_pieces(
      {{{-0.2, -0.4}, {-0.349938622, -0.310337627}, {-0.6, -0.45}}, {{-0.65, -0.3}, {-0.229959986, -0.317206967}}}, 2,
      1);
  trials.expect_pieces(
      {{{0, -0.35}, {-0.25, 0.250478957}, {-0.1, 0.25}, {-1.02408984e-07, 0.333431861}, {-0.499999981, 0.166666665}}},
      2, 1);
  trials.expect_pieces({{{-0.0832890331, 0.0792001918}, {-0.25, 0.1}, {-0.15, 0}, {-0.0832890331, 0.0792001918}}}, 2,
                       1);
  trials.expect_pieces({{{-0.35, 0}, {-0.65, 0}}, {{-0.25, -0.25}, {-0.5, 0.1}, {-0.35, 0.65}}}, 3, 1);
  trials.expect_pieces({{{-0.1, 0.2},
                         {-0.03, 0},
                         {-0.062, -0.034},
                         {-0.083, -0.046400143841255223},
                         {-0.10482921401378195, -0.054361402211690278},
                         {-0.12813852648255686, -0.057842120329241645},
                         {-0.1, 0.2}}},
                       2, 1);
  trials.expect_pieces({{{0.15, 0.45}, {0.38, 0.337}, {0.4, 0.6}}, {{0, 0.25}, {0.39, 0.34}, {0.8, -0.55}}}, 2, 200);
  trials.expect_pieces(
      {{{0.33256368800311426, 0.1609208258439746}, {0.25, 0.3}, {0.3, 0}, {0.33256368800311426, 0.1609208258439746}}},
      2, 1);
  trials.expect_pieces({{{0, 3.23771116e-06}, {0.0833336745, -0.0833333333}},
                        {{-0.05, -0.65}, {-0.333333341, 0.166666667}, {0.50674719, -0.344842195}, {0, -0.5}}},
                       3, 2);
}

// The edge stands at the corner at the end of a pose. What the plane of the next move touches there has no length, and is neither the way on nor a layer that was
// missed: the cut led from the corner backwards to the rim.
TEST_F(StrokeOracle, CornersCutOneWay) {
  Trials(sheet).expect_pieces({{{0.65, -0.25}, {0.47, -0.07}, {0.35, -0.29}}}, 1, 8);
  Trials(sheet).expect_pieces(
      {{{-0.1, 0.4}, {-0.43, 0.48897659097125179}, {-0.086530861294418476, 0.5708055755619641}}}, 1, 2);
}

// Stabbed a little more than a minimum feature from a vertex and less from its edges; the path was refused.
TEST_F(StrokeOracle, AStabBesideAVertexIsCut) {
  sheet.cut({{-0.0881, -0.25}, {0, -0.35}}, 1);
  EXPECT_EQ(sheet.refused, 0);
  EXPECT_LT(StrokeJudge::deviation(sheet, {{{-0.0881, -0.25}, {0, -0.35}}}).missed,
            sheet.options.minimum_feature * edge());
}

// Each of these was cut beside its place, or lost a part: a turn at a vertex of the rim; a path back along itself; a line that goes on behind another slit; a turn
// at a vertex of the rim beside a slit, in small poses; a turn on a slit that the path has run along; a corner after a border.
TEST_F(StrokeOracle, NothingIsLostAtTurns) {
  const auto expect_in_place = [&](const std::vector<Stroke>& strokes, int poses) {
    sheet.make_whole();
    for (const Stroke& s : strokes) sheet.cut(s, poses);
    EXPECT_EQ(sheet.refused, 0) << text_of(strokes);
    const auto deviation = StrokeJudge::deviation(sheet, strokes);
    EXPECT_LT(std::max(deviation.stray, deviation.missed),
              (sheet.options.path_tolerance + sheet.options.minimum_feature) * edge())
        << text_of(strokes);
  };
  expect_in_place({{{0.35, -0.35}, {-1.0 / 3, -0.5}, {0.33, -0.15}}}, 3);
  expect_in_place({{{0, -0.33}, {0.08, -0.25}, {0.166, -0.3333}, {0.08, -0.25}}}, 1);
  expect_in_place({{{0.85, 0.5}, {-0.2, -0.95}},
                   {{0.778752357861996, 0.541797715225260}, {-0.297923259843109, -0.900689586010078}},
                   {{-0.571705369488706, 0.738683268556329}, {0.870781931750631, -0.337992349149976}}},
                  3);
  expect_in_place({{{0.5, 0.5}, {-0.1666, -0.5}, {0.15, -0.33}}}, 200);
  expect_in_place({{{0.33, -0.167}, {0.5, -0.35}}, {{0.25, -0.25}, {0.35, -0.167}, {0.2, -0.17}}}, 1);
  expect_in_place({{{0, 0.33}, {0.15, 0.5}}, {{-0.35, 0.35}, {0, 0.333}, {0.15, 0.33}, {0, 0.15}}}, 1);
}

// Where strokes meet, a pose's path may be so short that it would cut off a crumb only. The cut goes on with the next pose from where it has got to, or nothing
// parts that pose's way.
TEST_F(StrokeOracle, AShortPathAtACrumbGoesOn) {
  const StrokeJudge judge{0.12 * edge(), 0.9 * sheet.options.minimum_feature * edge()};
  const std::vector<Stroke> stars[] = {
      {{{1.20730554595062, -0.119409805471942}, {-1.70546235068459, 0.598770659544563}},
       {{1.23639585168171, 0.44792476035481}, {-1.73455301879698, 0.0314360942408081}},
       {{1.05234398262106, 0.985691691226032}, {-1.55066627561837, -0.505729642770606}},
       {{0.681784121989655, 1.4159010556859}, {-1.17994092594826, -0.93654019669014}}},
      {{{0.116555666487246, -1.47552976964165}, {-0.535916505562934, 1.45265739389488}},
       {{0.571137788397659, -1.29464670832735}, {-0.990498625216103, 1.26685513857332}},
       {{0.942342591895352, -0.974507203618115}, {-1.36170344895131, 0.946787110551069}}}};
  for (const auto& star : stars) {
    sheet.make_whole();
    for (const Stroke& s : star) sheet.cut(s);
    EXPECT_EQ(judge.judge(sheet, star).bridges, 0);
    EXPECT_LT(StrokeJudge::deviation(sheet, star).missed, 0.048 * edge());
    EXPECT_EQ(sheet.refused, 0);
  }
}

// The blade goes along the lip of a slit for a while, in one pose, then beyond its tip: when it comes to what runs along its way is next to rounding.
TEST_F(StrokeOracle, AStrokeAlongASlitGoesOnBeyondItsTip) {
  Trials(sheet).expect_pieces({{{0.260240452000754, 0.603412535242162}, {-0.341093248351697, -0.119461517103839}},
                               {{0.494222145896795, 0.88468613614342}, {-0.544056118268151, -0.363446832023473}}},
                              2, 1);
}

// Four strokes of one to five segments anywhere, crossing each other and themselves.
TEST_F(StrokeOracle, RandomPolylines) {
  Random random(10);
  const StrokeJudge judge{0.12 * edge(), 0.9 * sheet.options.minimum_feature * edge()};
  int bridged = 0, severed = 0;
  for (int i = 0; i < 25; ++i) {
    std::vector<Stroke> strokes(4);
    for (Stroke& s : strokes)
      for (int k = 2 + random.index(5); k > 0; --k)
        s.push_back({random.uniform(-0.65, 0.65), random.uniform(-0.65, 0.65)});
    sheet.make_whole();
    for (const Stroke& s : strokes) sheet.cut(s);
    const Status valid = validate_complex(sheet.body, sheet.start);
    ASSERT_TRUE(valid.ok()) << (valid.ok() ? "" : valid.error().message) << text_of(strokes);
    const auto verdict = judge.judge(sheet, strokes);
    bridged += verdict.bridges > 0;
    severed += verdict.severed > 0;
  }
  EXPECT_EQ(bridged, 0);
  EXPECT_EQ(severed, 0);
}

/// Sets of strokes of each kind, in one to 200 poses a segment. KERF_FUZZ_SECONDS=n in the environment: so long for each kind, KERF_FUZZ_SEED=s from another
/// seed, and what goes wrong is printed, not failed on.
class StrokeSetsOracle : public ::testing::TestWithParam<int> {};

TEST_P(StrokeSetsOracle, PartWhatTheyGoAround) {
  const auto kind = static_cast<SetKind>(GetParam());
  const char* seconds = std::getenv("KERF_FUZZ_SECONDS");
  const char* first_seed = std::getenv("KERF_FUZZ_SEED");
  constexpr std::uint64_t kSets = 20;
  const std::uint64_t first = first_seed ? std::strtoull(first_seed, nullptr, 10) : 1;
  const auto begin = std::chrono::steady_clock::now();
  const auto spent = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); };
  StrokeBody body("closed-sheet", 2500);
  const double edge = body.body.mean_root_edge;
  const CollisionMesh mesh = body.body.collision;
  const StrokeSets sets(mesh, 1, edge);
  const StrokeJudge judge{0.12 * edge, 0.9 * body.options.minimum_feature * edge};
  // A path is straight to within its tolerance between vertices, and these are rounded by a minimum feature.
  const double strays = (body.options.path_tolerance + body.options.minimum_feature) * edge;
  int count = 0, bridged = 0, severed = 0, refused = 0, off = 0;
  for (std::uint64_t seed = first; seconds ? spent() < std::atof(seconds) : seed < first + kSets; ++seed) {
    Random random(1000 * seed + static_cast<std::uint64_t>(GetParam()));
    const std::vector<Stroke> strokes = sets.make(kind, random);
    constexpr int kPoses[] = {1, 2, 3, 8, 40, 200};
    const int poses = kPoses[random.index(6)];
    body.make_whole();
    for (const Stroke& s : strokes) body.cut(s, poses);
    const Status valid = validate_complex(body.body, body.start);
    ASSERT_TRUE(valid.ok()) << valid.error().message << text_of(strokes);
    const Status volumes = validate_piece_volumes(body.body, body.start);
    ASSERT_TRUE(volumes.ok()) << volumes.error().message << text_of(strokes);
    const auto verdict = judge.judge(body, strokes);
    ++count;
    bridged += verdict.bridges > 0;
    severed += verdict.severed > 0;
    refused += body.refused > 0;
    const auto deviation = StrokeJudge::deviation(body, strokes);
    const bool is_off = std::max(deviation.stray, deviation.missed) > strays;
    off += is_off;
    if (seconds && (verdict.bridges > 0 || verdict.severed > 0 || body.refused > 0 || is_off))
      printf("seed %llu, %d poses: %d bridges, %d severed, %d refused, %.3f and %.3f edges off:%s\n",
             static_cast<unsigned long long>(seed), poses, verdict.bridges, verdict.severed, body.refused,
             deviation.stray / edge, deviation.missed / edge, text_of(strokes).c_str());
  }
  printf("%s: %d sets, %d with a bridge, %d severed, %d refused, %d beside their place\n", kSetKinds[GetParam()], count,
         bridged, severed, refused, off);
  if (seconds) return;
  EXPECT_EQ(bridged, 0);
  EXPECT_EQ(severed, 0);
  EXPECT_EQ(refused, 0);
  EXPECT_EQ(off, 0);
}

INSTANTIATE_TEST_SUITE_P(Kinds, StrokeSetsOracle, ::testing::Range(0, static_cast<int>(std::size(kSetKinds))),
                         [](const auto& kind) {
                           std::string name = kSetKinds[kind.param];
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

}  // namespace
}  // namespace kerf::stroke_oracle_test

#include "integrators/tables/composition_tables.h"

#include <type_traits>

#include "phs/error.h"
#include "phs/scalars/scalar.h"

namespace porthos::integrators {
namespace {

using phs::Quad;

/// x rounded to a multiple of the unit of T: adding 1.5·2^k removes all bits of a Quad below 2^(k -
/// 112).
template <class T>
Quad to_unit(Quad x) {
  const Quad shifter = Quad(1.5) * (std::is_same_v<T, Quad> ? Quad(0x1p3) : Quad(0x1p61));
  return (x + shifter) - shifter;
}

}  // namespace

template <class T>
std::vector<T> CompositionTable::gammas() const {
  std::vector<T> g;
  Quad sum = 0;
  for (const char* digits : outer) {
    const Quad x = to_unit<T>(phs::strtoflt128(digits, nullptr));
    sum += x;
    g.push_back(T(x));
  }
  g.push_back(T(centre == Centre::one ? 1 - 2 * sum : Quad(0.5) - sum));
  for (size_t i = size_t(stages()) / 2; i-- > 0;) g.push_back(g[i]);
  return g;
}
template std::vector<double> CompositionTable::gammas<double>() const;
template std::vector<Quad> CompositionTable::gammas<Quad>() const;

// Published to 15 … 32 digits. Refined here by Newton's method on the order conditions; if they
// leave freedom, by the smallest correction. The corrections are below 2e-15, except for Yoshida's
// order 8 (1e-12).
// NOLINTNEXTLINE(readability-function-size): a table
const std::vector<CompositionTable>& symmetric_compositions() {
  static const std::vector<CompositionTable> all{
      {"suzuki4",
       "Suzuki's fractal",
       4,
       Centre::one,
       {"0.414490771794375737142354062860761495711775",  // 1/(4 - 4^(1/3))
        "0.414490771794375737142354062860761495711775"},
       "Suzuki 1990"},
      {"yoshida4",
       "triple jump",
       4,
       Centre::one,
       {"1.351207191959657634047687808971460826921999"},  // 1/(2 - 2^(1/3))
       "Creutz, Gocksch 1989; Suzuki 1990; Yoshida 1990"},
      {"mclachlan4",
       "McLachlan's five stages",
       4,
       Centre::one,
       {"0.28", "0.625466428467670045012338905492649012918216"},
       "McLachlan 1995"},
      {"yoshida6",
       "Yoshida's solution A",
       6,
       Centre::one,
       {"0.784513610477557263819497633866349875776824",
        "0.235573213359358133684793182978534601686468",
        "-1.177679984178871006946415680964315734639269"},
       "Yoshida 1990, Table 1"},
      {"kahan_li6",
       "Kahan and Li, nine stages",
       6,
       Centre::one,
       {"0.392161444007314139279250557422671403804934",
        "0.332599136789359438599748637500049646881587",
        "-0.706246172557639359809964819549256459395511",
        "0.082213596293550800231490448102056331103294"},
       "Kahan, Li 1997, s9odr6a"},
      {"sofroniou_spaletta6",
       "Sofroniou and Spaletta, 13 stages",
       6,
       Centre::one,
       {"0.138619308540516952458080130426253536881090",
        "0.133465628510747604070468588322092559882785",
        "0.130705310114492251905427557850152043888316",
        "0.129618937569070347725053665370911842305732",
        "-0.350003248939208965161708309113225605668840",
        "0.118055306530023871702734389540489754872503"},
       "Sofroniou, Spaletta 2005"},
      {"suzuki_umeno8",
       "Suzuki and Umeno, 15 stages",
       8,
       Centre::one,
       {"0.741670364350612953448227801783806315603537",
        "-0.409100825800031593997300095893563417309918",
        "0.190754710296238379953876256450371662735461",
        "-0.573862471116082266656387726635535742159509",
        "0.299064181303655923844463540688602988225823",
        "0.334624918245298183784957979882182288633692",
        "0.315293092396766596632056663811002430994081"},
       "Suzuki, Umeno 1993; McLachlan 1995"},
      {"kahan_li8",
       "Kahan and Li, 17 stages",
       8,
       Centre::one,
       {"0.130202483088890080878817632096700522357247",
        "0.561162981775108384561964407700150567266159",
        "-0.389474962644847286408078598235248388836068",
        "0.158841906555155600896210745707152481412148",
        "-0.395903894133237577336231539347938936026771",
        "0.184539640978315707091832541533375462818987",
        "0.258374387686322047293979109994939471813076",
        "0.295011723609310298870966240218228112976543"},
       "Kahan, Li 1997, s17odr8a"},
      {"yoshida8",
       "Yoshida's solution D",
       8,
       Centre::one,
       {"1.042426208699704264348953268397656476105561",
        "1.820206309706980069331733166121399780809397",
        "0.157739928123708321342825783079542004840526",
        "2.440027326166344063816895897619430943537838",
        "-0.007169894197095332099806129249649109481199",
        "-2.446991823704245889294691452381462484560821",
        "-1.615823741500653784787940197458742165897200"},
       "Yoshida 1990, Table 2"},
      {"sofroniou_spaletta8",
       "Sofroniou and Spaletta, 21 stages",
       8,
       Centre::one,
       {"0.106477289845500318239319678548958484601627",
        "0.108374086458357263974334105915459272702153",
        "0.353378210526543424195345413240799338395267",
        "-0.233414140231650821987802811283194812436827",
        "-0.244452667915288412694621714132164157486497",
        "0.113178484357556333147009525155989713980571",
        "0.118929056250003500626929722839508468711764",
        "0.126039123218259881403056702683646235604959",
        "0.125817187361760418043923916415866226923903",
        "0.116991350192176421807228814335329081823500"},
       "Sofroniou, Spaletta 2005"},
      {"sofroniou_spaletta10",
       "Sofroniou and Spaletta, 35 stages",
       10,
       Centre::one,
       {"0.078795722521686419263907679337684248298973",
        "0.313096103415108527764812471926472696094055",
        "0.027918383235078066109520273275298821934667",
        "-0.229592841593907094151213396796549876489778",
        "0.130962061077164863174656859279605414264686",
        "-0.269733405654510714344609732224111496250772",
        "0.074973343155891435666137105641410412048935",
        "0.111993423999810204889575080736402058825331",
        "0.366133449546226751193148123531499083090094",
        "-0.399105630136035897878629810583404730472994",
        "0.103087398527471077315802770013724476747122",
        "0.411430873955890237820704118976078350684242",
        "-0.004866360583135261762195659309977062737516",
        "-0.392033353708639906448081936426104270184497",
        "0.051942502962449647037182904015975813379014",
        "0.050665090759924496335874344156865797035679",
        "0.049674370639729879054568800279460933716868"},
       "Sofroniou, Spaletta 2005; Hairer, Lubich, Wanner 2006, V.3.2"},
  };
  return all;
}

const std::vector<CompositionTable>& adjoint_compositions() {
  static const std::vector<CompositionTable> all{
      {"strang", "Strang splitting", 2, Centre::two, {}, "Strang 1968; Marchuk 1968"},
      {"mclachlan4_splitting",
       "McLachlan's splitting",
       4,
       Centre::two,
       {"0.089269454226475244886694611260559114267250",   // (14 - √19)/108
        "0.310730545773524755113305388739440885732750",   // (146 + 5√19)/540
        "-0.408066588410420263128665332137749308084223",  // (-23 - 20√19)/270
        "0.308066588410420263128665332137749308084223"},  // (-2 + 10√19)/135, then 1/5
       "McLachlan 1995; Hairer, Lubich, Wanner 2006, V (3.6)"},
      {"blanes_moan4",
       "Blanes and Moan's splitting S6",
       4,
       Centre::two,
       {"0.079203696431195669433663495888268873308020",
        "0.130311410182166351840409144141232143594119",
        "0.222861495867607636640652167431888912936252",
        "-0.366713269047425644915767225288416638584491",
        "0.324648188689706109547656926985899599864081"},
       "Blanes, Moan 2002, Table 2"},
      {"blanes_moan6",
       "Blanes and Moan's splitting S10",
       6,
       Centre::two,
       {"0.050262764400392686021221654402074109406013",
        "0.098553683500650545899679351133503479471384",
        "0.314960616927693269163384369000380959503885",
        "-0.447346482695476916612229795599320881078375",
        "0.492426372489874979581126847723834352240093",
        "-0.425118767797690521430868951131233305340730",
        "0.237063913978121606631740462212362762852911",
        "0.195602488600051990895927508671182535205273",
        "0.346358189850728143935487232261889961142900"},
       "Blanes, Moan 2002, Table 2"},
  };
  return all;
}

const CompositionTable& composition_table(const std::string& name) {
  for (const auto* tables : {&symmetric_compositions(), &adjoint_compositions()})
    for (const auto& t : *tables)
      if (t.name == name) return t;
  throw InvalidArgument("no composition table '" + name + "'");
}

}  // namespace porthos::integrators
